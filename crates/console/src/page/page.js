// Draws what the console shows, and nothing fresher: every age here is at most so great by this page's own clock, counted
// from the moment at which it asked for the picture. A picture that is not followed by another is not current, and said so.
"use strict";

const ASK_MS = 100; // between two pictures
const DRAW_MS = 200; // without a new one, ages are drawn anew
const AGAIN_MS = 500; // before one is asked for again of who did not answer
const CURRENT_MS = 1000; // older than this, a picture is not current
const WORDS = ["fresh", "LATE", "STALE", "LOST"];
const SHAPES = { fresh: "●", LATE: "○", STALE: "◆", LOST: "✕" };
const TONES = { fresh: "normal", LATE: "advice", STALE: "caution", LOST: "alarm" };
const MODES = { HOLD_SAFE: "caution filled", DEGRADED: "caution filled", PREPARE_TO_ACT: "mark filled" };
const PRIORITIES = { HIGH: ["alarm", "■"], MEDIUM: ["caution", "◆"], LOW: ["advice", "▲"] };
const ORIGINS = { DIRECT: "normal" };

/** Time that has passed since `then`, milliseconds: the larger of two clocks, for one of them may stand while a host sleeps. */
const now = () => ({ steady: performance.now(), wall: Date.now() });
const since = (then) => Math.max(performance.now() - then.steady, Date.now() - then.wall, 0);

/** The newest picture: {picture, before, at}, where `before` is how old it was at most when it came, or null where unknown. */
let newest = null;
/** The site as the mission was planned on it: no statement about the world now. */
let site = null;
let spoken = "";
let drawn = now();

function element(name, classes, ...content) {
  const made = document.createElement(name);
  if (classes) made.className = classes;
  made.append(...content);
  return made;
}

const seconds = (ms) => (ms === null || !Number.isFinite(ms) ? "unknown" : ms < 10000 ? `${(Math.ceil(ms / 10) / 100).toFixed(2)} s` : `${Math.ceil(ms / 1000)} s`);
const left = (ms) => `${(Math.floor(ms / 10) / 100).toFixed(2)} s left`;
const metres = (mm) => (mm / 1000).toFixed(1);

/** A value that ages, as it may be drawn now: no fresher than the console said, and older by what passed since. */
function aged(of, extra, limits) {
  const age = of.age_ms === null ? null : limits ? of.age_ms + extra : of.age_ms;
  const by = !limits ? 0 : age === null ? 3 : age <= limits.fresh ? 0 : age <= limits.late ? 1 : age <= limits.stale ? 2 : 3;
  const word = WORDS[Math.max(WORDS.indexOf(of.freshness), by)];
  return { value: of.value, word, age, tone: TONES[word] };
}

/** A track, as it may be drawn now. One that its unit no longer reports is lost, however young, and asks for less than a unit that is lost with all its tracks. */
function track(of, extra, limits) {
  const made = aged(of, extra, limits);
  return { ...made, tone: !of.value.reported ? "advice" : made.word === "LOST" ? "caution" : made.tone };
}

const freshness = (of) => element("span", of.tone, `${SHAPES[of.word]} ${of.word} ${seconds(of.age)}`);

/** A table, or that there is nothing in it. */
function table(into, heads, rows, none) {
  const place = document.getElementById(into);
  if (rows.length === 0) return place.replaceChildren(element("p", "weak", none));
  const head = element("thead", "", element("tr", "", ...heads.map((name) => Object.assign(element("th", "", name), { scope: "col" }))));
  const body = element("tbody", "", ...rows.map((cells) => element("tr", "", ...cells.map((cell) => element("td", "", cell)))));
  const top = place.scrollTop;
  place.replaceChildren(element("table", "", head, body));
  place.scrollTop = top;
}

function condition({ name, value, limit }) {
  return !value ? name : limit ? `${name} (${value}, limit ${limit})` : `${name} (${value})`;
}

function unit(of, picture, extra) {
  const state = aged(of.state, extra, picture.limits_ms);
  const { mode, cause, authority, speed_mm_s } = state.value;
  const failing = state.value.guards.filter((guard) => !guard.holds);
  const fresh = state.word === "fresh";
  const shown = fresh
    ? element("span", `chip ${MODES[mode] || "normal"}`, mode)
    : element("span", `chip ${state.tone}`, "was ", element("s", "", mode), ` · ${state.word}`);
  const held = authority ? `track ${authority.track}, ${left(authority.left_ms)}` : "none";
  const guards = failing.length ? failing.map(condition).join(", ") : "nothing";
  const clock = element("span", /RUNS AWAY/.test(of.clock) ? "caution" : "weak", of.clock || "clock not known yet");
  if (of.clock_ppm !== null) clock.title = `against the console's: ${of.clock_ppm[0]} to ${of.clock_ppm[1]} ppm`;
  return element("div", "unit", element("strong", "", of.unit), shown, freshness(state),
    element("span", "", fresh ? `for ${seconds(of.since_ms === null ? null : of.since_ms + extra)}, cause ${cause}` : `cause was ${cause}`),
    element("span", fresh && authority ? "mark" : fresh ? "" : "caution", fresh ? `authority ${held}` : `authority unknown, was ${held}`),
    element("span", failing.length ? "caution" : "", `${fresh ? "fails" : "failed"}: ${guards}`),
    element("span", "", `${(Math.round(speed_mm_s / 100) / 10 + 0).toFixed(1)} m/s`),
    element("span", ORIGINS[of.origin] || "caution", `origin ${of.origin}`),
    clock);
}

function svg(name, attributes, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

/** Geofence, route and known obstacles. */
function planned({ fence, route, looped, blocks }, at) {
  const along = (places) => `M${places.map(([east, north]) => at(east * 1000, north * 1000).join(" ")).join("L")}`;
  const drawn = [];
  if (fence.length > 2) drawn.push(svg("path", { class: "fence", d: `${along(fence)}Z`, fill: "none" }));
  if (route.length > 1) drawn.push(svg("path", { class: "route", d: along(route) + (looped ? "Z" : ""), fill: "none" }));
  for (const { at: [east, north], half } of blocks) {
    const [[x, y], [side]] = [at(east * 1000, north * 1000), at(Math.max(...half) * 1000, 0)];
    drawn.push(svg("circle", { class: "route", cx: x, cy: y, r: Math.max(side - at(0, 0)[0], 2), fill: "none" }));
  }
  if (fence.length > 2) {
    const [x, y] = at(Math.min(...fence.map((place) => place[0])) * 1000, Math.max(...fence.map((place) => place[1])) * 1000);
    drawn.push(svg("text", { x: x + 4, y: y + 12, fill: "var(--weak)" }, "geofence and route as planned"));
  }
  return drawn;
}

/** What may be where: around each place the circle in which it may be by now, its age times the greatest speed. */
function map(picture, extra) {
  const things = [];
  for (const of of picture.units) {
    const place = aged(of.place, extra, picture.limits_ms);
    things.push({ ...place, x: place.value.x_mm, y: place.value.y_mm, name: of.unit, body: true });
    for (const each of of.tracks) {
      const seen = track(each, extra, picture.limits_ms);
      things.push({ ...seen, x: seen.value.x_mm, y: seen.value.y_mm, name: `${seen.value.id} ${seen.value.class}` });
    }
  }
  const place = document.getElementById("map");
  const worse = things.filter((thing) => thing.word !== "fresh").length;
  place.setAttribute("aria-label", `map: ${picture.units.length} units, ${things.length - picture.units.length} tracks, ${worse} not fresh`);
  const fence = site ? site.fence : [];
  const span = (of, axis) => [...of, ...fence.map((place) => place[axis] * 1000)];
  const ends = (of) => [Math.min(...of, -20000), Math.max(...of, 20000)];
  const [[west, east], [south, north]] = [ends(span(things.map((t) => t.x), 0)), ends(span(things.map((t) => t.y), 1))];
  const scale = Math.min(560 / (east - west), 400 / (north - south));
  const at = (x, y) => [300 + (x - (east + west) / 2) * scale, 220 - (y - (north + south) / 2) * scale];
  const drawn = [];
  for (let line = -200; line <= 200; line += 10) {
    const [x, y] = at(line * 1000, line * 1000);
    drawn.push(svg("path", { class: "grid", d: `M${x} 0V440M0 ${y}H600`, fill: "none" }));
  }
  if (site) drawn.push(...planned(site, at));
  things.sort((a, b) => WORDS.indexOf(b.word) - WORDS.indexOf(a.word));
  for (const thing of things) {
    const [x, y] = at(thing.x, thing.y);
    const may = thing.age === null ? 0 : Math.min((thing.age / 1000) * picture.max_speed_mm_s, 60000) * scale;
    const color = `var(--${thing.tone === "normal" ? "text" : thing.tone})`;
    if (may > 4) drawn.push(svg("circle", { cx: x, cy: y, r: may, fill: "none", stroke: color, "stroke-dasharray": "6 4" }));
    const label = thing.word === "fresh" ? thing.name : `${thing.name} ${thing.word} ${seconds(thing.age)}`;
    drawn.push(svg("text", { x: x - 5, y: y + 4, fill: color }, thing.body ? "▲" : SHAPES[thing.word]));
    const left = x > 420;
    drawn.push(svg("text", { x: left ? x - 10 : x + 10, y: y + 4, fill: color, "text-anchor": left ? "end" : "start" }, label));
  }
  drawn.push(svg("text", { x: 592, y: 432, fill: "var(--weak)", "text-anchor": "end" }, "lines every 10 m, north up"));
  place.replaceChildren(...drawn);
}

function marks(picture) {
  const all = [["mark", "SIMULATION"]];
  if (picture.replay) all.push(["advice", "REPLAY · nothing here is now"]);
  if (picture.ablation) all.push(["caution", `ABLATION ${picture.ablation}`]);
  if (picture.host_wait_ms) all.push(["caution", `HOST BUSY ${picture.host_wait_ms} ms`]);
  all.push(["weak", `${picture.operator} · ${picture.role}`]);
  document.getElementById("marks").replaceChildren(...all.map(([tone, text]) => element("li", tone, text)));
}

function draw() {
  drawn = now();
  const banner = document.getElementById("current");
  if (!newest) return;
  const { picture, before, at } = newest;
  const passed = since(at);
  const extra = before === null ? null : before + passed;
  const old = extra === null || extra > CURRENT_MS;
  document.body.classList.toggle("old", old);
  banner.hidden = !old;
  if (old) {
    const text = `NOT CURRENT · ${extra === null ? "nobody knows how old this is" : `no picture for ${seconds(Math.floor(extra / 1000) * 1000)}`}; to hold, use other means`;
    if (banner.textContent !== text) banner.textContent = text;
  }
  // Of a picture whose own age nobody knows, nothing is fresh.
  const by = extra === null ? Infinity : extra;
  marks(picture);
  const silent = picture.silent.map((name) => element("div", "unit", element("strong", "", name), element("span", "chip alarm", "✕ NOTHING RECEIVED")));
  document.getElementById("units").replaceChildren(...picture.units.map((of) => unit(of, picture, by)), ...silent);
  map(picture, by);
  const ago = (ms) => (ms === null || extra === null ? "unknown" : seconds(ms + extra));
  const tracks = picture.units.flatMap((of) => of.tracks.map((each) => {
    const seen = track(each, by, picture.limits_ms);
    const { id, x_mm, y_mm, confidence_permille } = seen.value;
    return [`${of.unit} ${id}`, freshness(seen), seen.value.class, (confidence_permille / 1000).toFixed(2), `${metres(x_mm)}, ${metres(y_mm)}`];
  }));
  const more = picture.units.filter((of) => of.lost_more > 0).map((of) => [of.unit, element("span", "advice", `✕ ${of.lost_more} more LOST`), "", "", ""]);
  table("tracks", ["track", "age", "class", "confidence", "east, north (m)"], [...tracks, ...more], "no tracks");
  table("alarms", ["priority", "what", "raised"], picture.alarms.map((of) => [
    element("span", of.acknowledged ? "weak" : PRIORITIES[of.priority][0], `${PRIORITIES[of.priority][1]} ${of.priority}`),
    `${of.says}${of.standing ? "" : ", over"}${of.acknowledged ? ", acknowledged" : ""}`, `${ago(of.since_ms)} ago`])
    .concat(picture.alarms_more > 0 ? [["", `and ${picture.alarms_more} more, for which there was no room`, ""]] : []), "no alarms");
  table("refusals", ["reason", "by", "from", "times", "last"], picture.refusals.map((of) => [of.reason, of.by, of.peer || "unknown", String(of.times), `${ago(of.last_ms)} ago`]), "nothing was refused");
  table("links", ["peer", "session", "last report"], picture.links.map((of) => {
    const open = aged(of.open, by, picture.limits_ms);
    const word = open.word === "fresh" || open.word === "LATE" ? (open.value ? "up" : "DOWN") : open.value ? "was up" : "was DOWN";
    return [of.peer, element("span", open.value ? open.tone : "alarm", `${SHAPES[open.value ? open.word : "LOST"]} ${word}`), of.heard_ms === null ? "never" : `${ago(of.heard_ms)} ago`];
  }), "no link is known");
  table("commands", ["command", "to", "given by", "what became of it", "since"], picture.commands.map((of) => [
    `${of.kind} ${of.id}`, of.unit, of.by, element("span", /NOT ACK/.test(of.life) ? "alarm" : /REFUSED|EXPIRED/.test(of.life) ? "caution" : "", of.life), `${ago(of.since_ms)} ago`]), "none was given");
  say(picture, old, by);
}

/** Changes of mode and of currency in words, for who cannot see them. */
function say(picture, old, by) {
  const state = (of) => aged(of.state, by, picture.limits_ms);
  const words = (of) => `${of.unit} ${state(of).word === "fresh" ? of.state.value.mode : state(of).word}`;
  const text = (old ? "not current; " : "") + picture.units.map(words).join(", ");
  if (text === spoken) return;
  spoken = text;
  document.getElementById("said").textContent = text;
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
      if (picture) newest = { picture, before: held_ms === null ? null : held_ms + since(asked), at: now() };
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

setInterval(() => since(drawn) >= DRAW_MS && draw(), DRAW_MS / 2);
plan();
ask();
