// Asks for one picture after the other and draws them in the window's order: marks, the four answers, units, alarms, map, the last
// minute, guards, tracks; links, orders and refusals are folded. A picture that is not followed by another is not current, and said so.
"use strict";

const ASK_MS = 100; // between two pictures
const DRAW_MS = 200; // without a new one, ages are drawn anew
const AGAIN_MS = 500; // before one is asked for again of who did not answer
const PRIORITIES = { HIGH: ["alarm", "■"], MEDIUM: ["caution", "◆"], LOW: ["advice", "▲"] };

/** The newest picture: {picture, before, at}, where `before` is how old it was at most when it came, or null where unknown. */
let newest = null;
/** The site as the mission was planned on it: no statement about the world now. */
let site = null;
/** Unit and track that a person chose; null where the page chooses. */
let chosen = null, chosenTrack = null;
let spoken = "";
let drawn = now();

/** The newest picture as it is at this instant. */
function look() {
  const { picture, before, at } = newest;
  const known = before === null ? null : before + since(at);
  // Of a picture whose own age nobody knows, nothing is fresh.
  const view = { picture, known, old: known === null || known > CURRENT_MS, extra: known === null ? Infinity : known };
  view.time = picture.at_us / 1000 + (known === null ? 0 : known);
  view.ago = (ms) => (ms === null || known === null ? "unknown" : `${lasting(ms + known)} ago`);
  return view;
}

/** The track of a unit whose confidence is plotted: the chosen, else the designated, else the surest. */
function trackOf(of) {
  const reported = of.tracks.filter((each) => each.value.reported).map((each) => each.value);
  if (of.tracks.some((each) => each.value.id === chosenTrack)) return chosenTrack;
  if (of.state.value.authority) return of.state.value.authority.track;
  const surest = reported.sort((a, b) => b.confidence_permille - a.confidence_permille)[0];
  return surest ? surest.id : null;
}

/** A table, or that there is nothing in it. */
function table(into, heads, rows, none) {
  if (rows.length === 0) return put(byId(into), element("p", { class: "weak" }, none));
  const head = element("thead", {}, element("tr", {}, ...heads.map((name) => element("th", { scope: "col" }, name))));
  const body = element("tbody", {}, ...rows.map((cells) => element("tr", {}, ...cells.map((cell) => element("td", {}, cell)))));
  return put(byId(into), element("table", {}, head, body));
}

function marks({ picture }) {
  const all = [["mark", `○ SIMULATION`]];
  if (picture.invalid) all.push(["alarm filled", `✕ INVALID · ${picture.invalid}`]);
  if (picture.ablation) all.push(["caution filled", `◆ ABLATION · ${picture.waived || picture.ablation}`]);
  if (picture.replay) all.push(["advice", "○ REPLAY · nothing here is now"]);
  if (picture.host_wait_ms) all.push(["caution", `◆ HOST BUSY ${picture.host_wait_ms} ms`]);
  put(byId("marks"), ...all.map(([classes, text]) => element("li", { class: `chip ${classes}` }, text)));
  tell("person", `${picture.operator} · ${picture.role}`);
}

function answer(kind, ask, of) {
  const headline = kind === "truth" && of.sign !== "normal" ? signed(of.sign, of.headline) : of.headline;
  const loud = of.sign === "lost" && kind !== "since" ? `headline ${tone(of.sign)}` : "headline";
  const detail = ([sign, text]) => {
    const bare = sign === "normal" || sign === "quiet" || (kind === "why" && sign === of.sign);
    return element("p", { class: "detail" }, bare && kind !== "truth" ? text : signed(sign, text));
  };
  return element("div", { class: `answer ${kind}` }, element("h2", {}, ask), element("p", { class: loud }, headline), ...of.details.map(detail));
}

/** The four answers of the chosen unit; another one that is worse is named beside its mode. */
function banner({ all, one }) {
  if (!one) return put(byId("banner"), element("p", { class: "weak" }, "no unit is known"));
  const { mode, why, since: lasts, next, truth } = one.banner;
  const many = element("p", { class: "whose" }, element("strong", {}, one.name), element("span", {}, all.length > 1 ? `${all.indexOf(one) + 1} of ${all.length} units` : ""));
  const block = element("div", { class: `mode ${SIGNS[mode.sign] ? mode.sign : "lost"}` }, many,
    element("p", { class: "headline" }, element("span", { "aria-hidden": "true" }, `${shape(mode.sign)} `), mode.headline),
    ...mode.details.map(([, text]) => element("p", { class: "detail" }, text)));
  const worst = all[0];
  if (ORDER.indexOf(worst.sign) > ORDER.indexOf(one.sign)) block.append(element("button", { type: "button", "data-unit": worst.name, class: "worse" }, `${worst.name} is worse: ${worst.banner.mode.headline}`));
  byId("banner").setAttribute("aria-label", `${one.name}, the four answers`);
  return put(byId("banner"), block, answer("why", "Why", why), answer("since", "Since", lasts), answer("next", "Do next", next), answer("truth", "Is this true?", truth));
}

function unitRow(each, view) {
  const { name, of, banner: { mode, why, since: lasts } } = each;
  const pressed = view.one === each;
  const state = of && stateOf(each, view), current = state && state.current;
  const room = of && current ? of.state.value.guards.find((guard) => guard.name === "geofence") : null;
  return element("button", { type: "button", class: "unit", "data-unit": name, "aria-pressed": String(pressed) },
    element("strong", {}, name),
    element("span", { class: `state ${SIGNS[each.sign] ? each.sign : "lost"}` }, element("span", { "aria-hidden": "true" }, `${shape(each.sign)} `), mode.headline),
    element("span", { class: "lasts" }, lasts.headline),
    element("span", { class: "cause" }, why.headline),
    element("span", { class: "room" }, room ? room.reading : ""),
    element("span", { class: "speed" }, current ? `${tenths(state.value.speed_mm_s / 1000)} m/s` : ""),
    element("span", { class: "old" }, state ? signed(state.sign, state.words) : signed("lost", "never heard")));
}

function units(view) {
  byId("s-units").hidden = view.all.length < 2;
  put(byId("units"), ...view.all.map((each) => unitRow(each, view)));
}

function alarm(of, view) {
  const [hue, mark] = PRIORITIES[of.priority] || PRIORITIES.HIGH;
  const notes = [of.acknowledged ? "acknowledged" : "new", of.standing ? "" : "over", of.times > 1 ? `${of.times} times` : ""].filter(Boolean);
  const led = of.led_to.map((each) => element("li", {}, element("span", {}, `led to: ${each.says}`), element("span", { class: "when" }, view.ago(each.since_ms))));
  return element("div", { class: `group ${of.standing ? hue : "weak"} ${of.acknowledged ? "noted" : "new"}` },
    element("p", { class: "first" }, element("span", {}, element("span", { class: of.standing ? hue : "weak" }, `${mark} ${of.priority} `), element("strong", {}, of.says)), element("span", { class: "when" }, view.ago(of.since_ms))),
    ...(led.length ? [element("ul", {}, ...led)] : []),
    element("p", { class: "note" }, notes.join(" · ")));
}

function alarms(view) {
  const { picture } = view;
  const all = picture.alarms, shelved = all.filter((of) => isKnown(of.shelved_ms) && of.shelved_ms > 0);
  const open = all.filter((of) => !shelved.includes(of)).map((of) => alarm(of, view));
  const none = open.length ? [] : [element("p", { class: "weak" }, "no alarms")];
  const back = Math.min(...shelved.map((of) => of.shelved_ms));
  const more = shelved.length ? [element("p", { class: "note" }, `${shelved.length} shelved, back within ${seconds(back)}`)] : [];
  if (picture.alarms_more > 0) more.push(element("p", { class: "note" }, `and ${picture.alarms_more} more, for which there was no room`));
  put(byId("alarms"), ...open, ...none, ...more);
  tell("n-alarms", `${picture.alarms_in_hour} in this hour · limit ${picture.alarms_limit}`);
}

/** Guards of the chosen unit, those that fail first. */
function guards({ of }, { current, value, age: old }) {
  const sorted = [...value.guards].sort((a, b) => a.holds - b.holds);
  const row = ({ title, name, reading, value: measured, holds }) => element("li", { class: holds ? "" : "fails" },
    holds ? element("span", {}, element("span", { class: "shape", "aria-hidden": "true" }, current ? "● " : "○ "), title || name) : element("span", {}, signed("caution", `${title || name} fails`)),
    element("span", { class: "reading" }, `${current ? "" : "was "}${reading || measured || "not used now"}`));
  put(byId("guards"), ...sorted.map(row));
  tell("n-guards", `of ${of.unit}, as reported ${atMost(old)} ago`);
}

function tracks({ of }, { planned: silent }, view) {
  const place = of.place.value, sorted = [...of.tracks].sort((a, b) => b.value.reported - a.value.reported || a.value.id - b.value.id);
  const rows = sorted.map((each) => {
    const seen = track(each, { ...view, silent });
    const { id, x_mm, y_mm, confidence_permille, modalities, contradicted, reported } = seen.value;
    const name = element("button", { type: "button", "data-track": id, "aria-pressed": String(id === view.track) }, `${id} ${seen.value.class}`);
    const age = signed(seen.sign, `${!reported ? "out of view " : seen.word === "fresh" ? "" : `${seen.word} `}${atMost(seen.age)}`);
    const borne = contradicted.length ? signed("caution", `${modalities.length} for, ${contradicted.length} against`) : `${modalities.length} of 4`;
    return [name, age, (confidence_permille / 1000).toFixed(2), `${Math.round(Math.hypot(x_mm - place.x_mm, y_mm - place.y_mm) / 1000)} m`, borne];
  });
  if (of.lost_more > 0) rows.push([`${of.lost_more} more`, signed("quiet", "out of view"), "", "", ""]);
  table("tracks", ["track", "age", "sure", "away", "sensors"], rows, "no tracks");
  tell("n-tracks", `of ${of.unit}`);
}

function links(view) {
  let down = 0;
  const rows = view.picture.links.map((of) => {
    const open = aged(of.open, view.extra, view.picture.limits_ms);
    const current = open.word === "fresh" || open.word === "LATE";
    if (!open.value || !current) down += 1;
    const word = current ? (open.value ? "up" : "DOWN") : open.value ? "was up" : "was DOWN";
    return [of.peer, signed(open.value ? open.sign : "lost", word), of.heard_ms === null ? "no report" : `report ${atMost(of.heard_ms + view.extra)} ago`];
  });
  table("links", ["peer", "session", "last report"], rows, "no link is known");
  put(byId("h-links"), down ? signed("lost", `Links · ${rows.length - down} of ${rows.length} up`) : `Links · ${rows.length} of ${rows.length} up`);
}

function folded(view) {
  const { picture } = view, { commands, refusals } = picture;
  const sign = (life) => (/NOT ACK/.test(life) ? "lost" : /REFUSED|EXPIRED/.test(life) ? "caution" : null);
  const rows = [...commands].reverse().map((of) => [`${of.kind} ${of.unit}`, sign(of.life) ? signed(sign(of.life), of.life) : of.life, of.by, view.ago(of.since_ms)]);
  table("commands", ["order", "what became of it", "given by", "when"], rows, "none was given");
  const bad = commands.filter((of) => sign(of.life)).length;
  put(byId("h-commands"), bad ? signed("caution", `Orders · ${commands.length}, ${bad} not carried out`) : `Orders · ${commands.length || "none"}`);
  table("refusals", ["reason", "by", "from", "times", "last"], refusals.map((of) => [of.reason, of.by, of.peer || "unknown", String(of.times), view.ago(of.last_ms)]), "nothing was refused");
  const times = refusals.reduce((sum, of) => sum + of.times, 0);
  tell("h-refusals", `Refusals · ${times || "none"}`);
}

/** How old the picture is: at the foot always, at the top when it is not current. */
function age({ known, old }) {
  document.body.classList.toggle("old", old);
  byId("current").hidden = !old;
  tell("alert", old ? "NOT CURRENT" : "");
  const whole = isKnown(known) ? `${Math.floor(known / 1000)} s` : null;
  tell("lag", whole ? `· no picture for ${whole}; to hold, use other means` : "· nobody knows how old this is; to hold, use other means");
  // In steps of a tenth, upwards: nobody reads hundredths that change ten times a second.
  put(byId("age"), signed(old ? "lost" : "normal", isKnown(known) ? `picture ≤ ${(Math.ceil((known + 1) / 100) / 10).toFixed(1)} s old` : "picture of unknown age"));
}

/** Changes of mode and of currency in words, for who cannot see them. */
function say({ all, old }) {
  const text = (old ? "not current; " : "") + all.map(({ name, banner: { mode } }) => `${name} ${mode.headline}`).join(", ");
  if (text === spoken) return;
  spoken = text;
  tell("said", text);
}

/** Everything but how old it is. */
function content(view) {
  marks(view);
  view.all = ranked(view);
  view.one = view.all.find((each) => each.name === chosen) || view.all[0];
  const of = view.one && view.one.of;
  view.track = of ? trackOf(of) : null;
  banner(view);
  units(view);
  alarms(view);
  map(view, view.one && view.one.name);
  document.querySelector("main").classList.toggle("unheard", !of);
  for (const id of ["s-plots", "s-guards", "s-tracks"]) byId(id).hidden = !of;
  if (of) {
    const state = stateOf(view.one, view);
    plots(of, state, view);
    guards(view.one, state);
    tracks(view.one, state, view);
    tell("n-plots", `of ${of.unit}`);
  }
  links(view);
  folded(view);
  say(view);
}

function draw() {
  drawn = now();
  if (!newest) return;
  const view = look();
  age(view);
  try {
    content(view);
  } catch (error) {
    // What stands here is then in part of an earlier picture.
    age({ ...view, old: true });
    tell("lag", "· a picture cannot be drawn; to hold, use other means");
    throw error;
  }
}

async function ask() {
  const asked = now();
  let again = AGAIN_MS;
  try {
    const answer = await fetch("picture", { cache: "no-store", signal: AbortSignal.timeout(2000) });
    if (answer.ok) {
      again = ASK_MS;
      const { held_ms, picture } = await answer.json();
      // It lay ready for so long when it was answered, and that was after it was asked for.
      if (picture) {
        newest = { picture, before: held_ms === null ? null : held_ms + since(asked), at: now() };
        record(picture);
      }
    }
  } catch {
    // Whoever gave the pictures has gone or stands still: what is here grows old by itself.
  }
  try {
    draw();
  } finally {
    // Whatever cannot be drawn, the next picture is asked for.
    setTimeout(ask, Math.max(again - since(asked), 20));
  }
}

/** Asks for the site until it is there. */
async function plan() {
  try {
    const answer = await fetch("site", { signal: AbortSignal.timeout(2000) });
    if (answer.ok) {
      site = await answer.json();
      return;
    }
  } catch {
    // As for a picture.
  }
  setTimeout(plan, AGAIN_MS);
}

/** A tap chooses a unit or a track; on the chosen one, the page chooses again. */
document.addEventListener("click", ({ target }) => {
  const pressed = target.closest("[data-unit], [data-track]");
  if (!pressed) return;
  const { unit, track: id } = pressed.dataset;
  if (unit !== undefined) [chosen, chosenTrack] = [chosen === unit ? null : unit, null];
  else chosenTrack = chosenTrack === Number(id) ? null : Number(id);
  draw();
});
setInterval(() => since(drawn) >= DRAW_MS && draw(), DRAW_MS / 2);
plan();
ask();
