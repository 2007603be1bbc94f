// Ages and answers as they may be shown now, and the tree that shows them. Nothing is shown fresher than the console showed it:
// every age is at most so great by this page's own clock, counted from the moment at which it asked for the picture.
"use strict";

const CURRENT_MS = 1000; // older than this, a picture is not current
const WORDS = ["fresh", "LATE", "STALE", "LOST"];
const AGED = { fresh: "normal", LATE: "past", STALE: "caution", LOST: "lost" };
/** Shape and tone of each sign; one that this page does not know is drawn as the worst. */
const SIGNS = {
  normal: ["●", "normal"], quiet: ["○", "weak"], authority: ["▲", "mark"], past: ["○", "advice"],
  caution: ["◆", "caution"], held: ["■", "caution"], lost: ["✕", "alarm"],
};
const ORDER = Object.keys(SIGNS);
const shape = (sign) => (SIGNS[sign] || SIGNS.lost)[0];
const tone = (sign) => (SIGNS[sign] || SIGNS.lost)[1];

/** Time that has passed since `then`, milliseconds: the larger of two clocks, for one of them may stand while a host sleeps. */
const now = () => ({ steady: performance.now(), wall: Date.now() });
const since = (then) => Math.max(performance.now() - then.steady, Date.now() - then.wall, 0);

const isKnown = (ms) => ms !== null && Number.isFinite(ms);
/** An age, rounded up as in the window. */
function seconds(ms) {
  if (!isKnown(ms)) return "unknown";
  if (ms < 10000) return `${(Math.ceil(ms / 10) / 100).toFixed(2)} s`;
  if (ms < 100000) return `${(Math.ceil(ms / 100) / 10).toFixed(1)} s`;
  return ms < 6000000 ? `${Math.ceil(ms / 60000)} min` : `${Math.ceil(ms / 3600000)} h`;
}
const atMost = (ms) => (isKnown(ms) ? `≤ ${seconds(ms)}` : "of unknown age");
/** How long something has lasted. */
function lasting(ms) {
  if (!isKnown(ms)) return "unknown";
  if (ms < 10000) return `${(Math.floor(ms / 100) / 10).toFixed(1)} s`;
  const whole = Math.floor(ms / 1000);
  if (whole < 60) return `${whole} s`;
  return whole < 3600 ? `${Math.floor(whole / 60)} min ${whole % 60} s` : `${Math.floor(whole / 3600)} h ${Math.floor(whole / 60) % 60} min`;
}
/** A number with one decimal and a minus that is one. */
const tenths = (number) => (Math.round(number * 10) / 10 + 0).toFixed(1).replace("-", "−");

/** A value that ages, as it may be drawn now: no fresher than the console said, and older by what passed since. */
function aged(of, extra, limits) {
  const age = of.age_ms === null ? null : limits ? of.age_ms + extra : of.age_ms;
  const by = !limits ? 0 : age === null ? 3 : age <= limits.fresh ? 0 : age <= limits.late ? 1 : age <= limits.stale ? 2 : 3;
  const said = WORDS.indexOf(of.freshness);
  const word = WORDS[Math.max(said < 0 ? 3 : said, by)];
  return { value: of.value, word, age, sign: AGED[word] };
}

/** A track, as it may be drawn now. One that its unit no longer reports is lost, however young: that asks for nothing. Nor does silence that is planned. */
function track(of, { extra, picture, silent }) {
  const made = aged(of, extra, picture.limits_ms);
  return { ...made, sign: !of.value.reported || (silent && made.word !== "fresh") ? "quiet" : made.sign };
}

/** State of a unit, as it may be drawn now, whether it is current, and words for its age. */
function stateOf({ of, banner }, { extra, picture }) {
  const state = aged(of.state, extra, picture.limits_ms), current = state.word === "fresh" || state.word === "LATE";
  const planned = !current && banner.mode.sign === "quiet";
  const word = state.word === "fresh" || planned ? "" : `${state.word} `;
  return { ...state, current, planned, sign: planned ? "quiet" : state.sign, words: word + atMost(state.age) };
}

/** Upper bound of the age of the oldest value of a unit. */
function oldest(of, extra, limits) {
  const reported = of.tracks.filter((each) => each.value.reported);
  const ages = [of.state, of.place, ...reported].map((each) => aged(each, extra, limits).age);
  return ages.every(isKnown) ? Math.max(...ages) : null;
}

/** The four answers as they may be shown now: the console's own, unless they have grown older here than what they were made for. */
function answers(of, view) {
  const { extra, old, picture } = view;
  const state = aged(of.state, extra, picture.limits_ms);
  const banner = of.banner;
  const age = [state.sign, `oldest value ${atMost(oldest(of, extra, picture.limits_ms))}`];
  const rest = banner.truth.details.slice(1);
  if (!old && state.word === of.state.freshness) {
    const first = banner.truth.details[0];
    return { ...banner, truth: { ...banner.truth, details: [[first ? first[0] : age[0], age[1]], ...rest] } };
  }
  const sign = old ? "lost" : state.sign;
  const no = { LATE: "Late", STALE: "No: it is stale" }[old ? "LOST" : state.word] || "No: it is old";
  const truth = { sign, headline: picture.invalid ? banner.truth.headline : no, details: [age, ...rest] };
  if (!old && state.word === "LATE") {
    const worse = ORDER.indexOf(banner.mode.sign) > ORDER.indexOf(sign) ? banner.mode.sign : sign;
    return { ...banner, mode: { sign: worse, headline: banner.mode.headline, details: [[sign, "late"]] }, truth };
  }
  const why = old ? "This page gets no new pictures" : "Its reports come here too late";
  return {
    mode: { sign, headline: `was ${state.value.mode}`, details: [[sign, old ? "not known now" : state.word.toLowerCase()]] },
    why: { sign, headline: why, details: [["normal", `it was: ${banner.why.headline}`]] },
    since: { sign: "normal", headline: "not known", details: [["normal", "for it is not heard"]] },
    next: { sign: "normal", headline: "Look at the window", details: [["normal", "HOLD is there, F1; else use other means"]] },
    truth,
  };
}

/** The answers for each unit, the worst first: {name, of, sign, banner}, where `of` is null for one that was never heard. */
function ranked(view) {
  const heard = view.picture.units.map((of) => ({ name: of.unit, of, banner: answers(of, view) }));
  const unheard = view.picture.unheard.map(({ unit, banner }) => ({ name: unit, of: null, banner }));
  const all = [...heard, ...unheard].map((one) => ({ ...one, sign: one.banner.mode.sign }));
  const rank = (one) => (ORDER.indexOf(one.sign) < 0 ? ORDER.length : ORDER.indexOf(one.sign));
  return all.sort((a, b) => rank(b) - rank(a));
}

function element(name, attributes, ...content) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  made.append(...content);
  return made;
}

function svg(name, attributes, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

/** Makes `place` hold what `made` does and keeps the nodes that are there, so that a tap, the focus and a selection outlive a picture. */
function put(place, ...made) {
  made.forEach((node, n) => {
    const there = place.childNodes[n];
    if (!there) place.append(node);
    else if (there.nodeName !== node.nodeName) there.replaceWith(node);
    else if (node.nodeType === Node.TEXT_NODE) there.data === node.data || (there.data = node.data);
    else renew(there, node);
  });
  while (place.childNodes.length > made.length) place.lastChild.remove();
}

function renew(there, made) {
  for (const { name } of [...there.attributes]) if (!made.hasAttribute(name)) there.removeAttribute(name);
  for (const { name, value } of made.attributes) if (there.getAttribute(name) !== value) there.setAttribute(name, value);
  put(there, ...made.childNodes);
}

/** Text with the shape of its sign before it. */
const signed = (sign, text) => element("span", { class: tone(sign) }, element("span", { "aria-hidden": "true" }, `${shape(sign)} `), text);
const byId = (id) => document.getElementById(id);
const tell = (id, text) => put(byId(id), document.createTextNode(text));
