// What the page has heard in the last minute, the map and the plots. Where nothing was heard, nothing is drawn.
"use strict";

const MINUTE_MS = 60000;
const MOST_SAMPLES = 700; // of a unit: ten a second, and some
const MOST_UNITS = 32;
const MAY_MM = 60000; // no circle of possible places is drawn greater

/** Samples of each unit: {at, mode, x, y, speed, room, sure}, and ages as shown: {at, age}. Times are the console's, milliseconds. */
const heard = new Map();
let latest = 0;

/** A guard's number in metres, or null. */
function roomOf(state) {
  const guard = state.value.guards.find((one) => one.name === "geofence");
  const found = guard && /^-?[\d.]+ m$/.test(guard.value) ? parseFloat(guard.value) : NaN;
  return Number.isFinite(found) ? found : null;
}

function keep(list, sample, least) {
  const last = list[list.length - 1];
  if (last && sample.at - last.at < least) return;
  list.push(sample);
  while (list.length > MOST_SAMPLES || (list.length && sample.at - list[0].at > MINUTE_MS + 2000)) list.shift();
}

/** Takes note of a picture. One of an earlier time begins anew. */
function record(picture) {
  const at = picture.at_us / 1000;
  if (at < latest) heard.clear();
  latest = at;
  for (const of of picture.units.slice(0, MOST_UNITS)) {
    if (!heard.has(of.unit)) heard.set(of.unit, { samples: [], ages: [] });
    const { samples, ages } = heard.get(of.unit);
    keep(ages, { at, age: of.state.age_ms }, 1);
    if (of.state.age_ms === null || !["fresh", "LATE"].includes(of.state.freshness)) continue;
    const sure = new Map(of.tracks.filter((each) => each.value.reported).map((each) => [each.value.id, each.value.confidence_permille / 1000]));
    const { x_mm, y_mm } = of.place.value;
    // One report is in several pictures: it is one sample.
    keep(samples, { at: at - of.state.age_ms, mode: of.state.value.mode, x: x_mm, y: y_mm, speed: of.state.value.speed_mm_s / 1000, room: roomOf(of.state), sure }, 20);
  }
  for (const name of heard.keys()) if (!picture.units.some((of) => of.unit === name)) heard.delete(name);
}

/** Path through points [at, x, y], broken where nothing was heard for longer than `gap`; a lone one is a dot. */
function path(points, gap) {
  let drawn = "", before = -Infinity;
  for (const [at, x, y] of points) {
    drawn += at - before > gap ? `M${x.toFixed(1)} ${y.toFixed(1)}h0` : `L${x.toFixed(1)} ${y.toFixed(1)}`;
    before = at;
  }
  return drawn;
}

/** Places for labels: none on another or on a symbol, none outside. A label that `must` be there may cover symbols, at worst labels. */
function labeller(width, height) {
  const symbols = [], labels = [];
  const apart = (box) => (other) => box[2] < other[0] || other[2] < box[0] || box[3] < other[1] || other[3] < box[1];
  const inside = (box) => box[0] >= 0 && box[1] >= 0 && box[2] <= width && box[3] <= height;
  const take = (x, y, half) => symbols.push([x - half, y - half, x + half, y + half]);
  const find = (x, y, text, must) => {
    const long = text.length * 7.4 + 2, all = [];
    for (const far of [10, 22, 38]) {
      for (const [dx, dy, anchor] of [[far, 0, 0], [-far, 0, 1], [0, -far - 4, 0.5], [0, far + 6, 0.5], [far, -far, 0], [far, far, 0], [-far, -far, 1], [-far, far, 1]]) {
        const west = x + dx - anchor * long;
        all.push({ x: x + dx, y: y + dy + 5, anchor: ["start", "middle", "end"][anchor * 2], leader: far > 10 ? [x + dx * 0.8, y + dy * 0.8] : null, box: [west, y + dy - 8, west + long, y + dy + 8] });
      }
    }
    const within = all.filter(({ box }) => inside(box)), clear = within.filter(({ box }) => labels.every(apart(box)));
    const found = clear.find(({ box }) => symbols.every(apart(box))) || (must ? clear[0] || within[0] || all[0] : null);
    if (found) labels.push(found.box);
    return found;
  };
  return { take, find };
}

/** Geofence, route and known obstacles. */
function planned({ fence, route, looped, blocks }, at) {
  const along = (places) => `M${places.map(([east, north]) => at(east * 1000, north * 1000).join(" ")).join("L")}`;
  const drawn = [];
  for (const { at: [east, north], half: [long, wide], yaw } of blocks) {
    const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
    const corner = ([x, y]) => [east + x * long * c - y * wide * s, north + x * long * s + y * wide * c];
    drawn.push(svg("path", { class: "block-on-map", d: `${along([[1, 1], [-1, 1], [-1, -1], [1, -1]].map(corner))}Z` }));
  }
  if (route.length > 1) drawn.push(svg("path", { class: "route", d: along(route) + (looped ? "Z" : "") }));
  if (fence.length > 2) drawn.push(svg("path", { class: "fence", d: `${along(fence)}Z` }));
  return drawn;
}

/** Everything that has a place: units first, then the chosen unit's tracks, then the others'. */
function things(view, chosen) {
  const { picture, extra } = view;
  const units = picture.units.map((of) => {
    const place = aged(of.place, extra, picture.limits_ms);
    const { x_mm, y_mm, yaw_mrad } = place.value;
    const mode = view.all.find((one) => one.of === of).banner.mode;
    return { ...place, sign: mode.sign, x: x_mm, y: y_mm, yaw: yaw_mrad / 1000, name: `${of.unit} ${mode.headline}`, chosen: of.unit === chosen, body: true, unit: of.unit };
  });
  const order = view.all.filter((one) => one.of).sort((a, b) => (b.name === chosen) - (a.name === chosen));
  const tracks = order.flatMap(({ of, banner }) => of.tracks.map((each) => {
    const seen = track(each, { ...view, silent: stateOf({ of, banner }, view).planned });
    const { id, x_mm, y_mm, reported } = seen.value;
    const over = !reported ? ` out of view ${seconds(seen.age)}` : seen.word === "fresh" ? "" : ` ${seen.sign === "quiet" ? "" : `${seen.word} `}${seconds(seen.age)}`;
    return { ...seen, x: x_mm, y: y_mm, name: `${id} ${seen.value.class}`, over, passed: !reported, chosen: of.unit === chosen && id === view.track };
  }));
  return [...units, ...tracks];
}

/** From millimetres east and north to the drawing: what is planned, and all units and reported tracks, have room. */
function projection(all, width, height) {
  const fence = site ? site.fence : [];
  const ends = (axis, values) => {
    const span = [...values, ...fence.map((place) => place[axis] * 1000)];
    return span.length ? [Math.min(...span) - 2000, Math.max(...span) + 2000] : [-20000, 20000];
  };
  const placed = all.filter((thing) => !thing.passed);
  const [[west, east], [south, north]] = [ends(0, placed.map((t) => t.x)), ends(1, placed.map((t) => t.y))];
  const scale = Math.min((width - 12) / Math.max(east - west, 20000), (height - 12) / Math.max(north - south, 20000));
  const at = (x, y) => [width / 2 + (x - (east + west) / 2) * scale, height / 2 - (y - (north + south) / 2) * scale];
  return { at, scale, middle: [(east + west) / 2, (north + south) / 2] };
}

/** Lines of a grid with their distances in metres; returns the step. */
function grid(into, { at, scale, middle }, width, height) {
  const step = [1, 2, 5].flatMap((n) => [1, 10, 100, 1e3, 1e4, 1e5, 1e6].map((ten) => n * ten)).sort((a, b) => a - b).find((m) => m * 1000 * scale >= 44) || 1e7;
  const first = middle.map((mm) => Math.round(mm / 1000 / step) * step);
  const many = Math.min(Math.ceil(Math.max(width, height) / (step * 1000 * scale) / 2) + 1, 40);
  for (let n = -many; n <= many; n++) {
    const [x] = at((first[0] + n * step) * 1000, 0), [, y] = at(0, (first[1] + n * step) * 1000);
    into.push(svg("path", { class: "grid", d: `M${x.toFixed(1)} 0V${height}M0 ${y.toFixed(1)}H${width}` }));
    if (x > 30 && x < width - 30) into.push(svg("text", { class: "axis", x: x + 3, y: height - 4 }, String(first[0] + n * step).replace("-", "−")));
    if (y > 20 && y < height - 30) into.push(svg("text", { class: "axis", x: 3, y: y - 3 }, String(first[1] + n * step).replace("-", "−")));
  }
  return step;
}

function trail(into, name, view, at) {
  const { samples } = heard.get(name) || { samples: [] };
  const gap = gapOf(view);
  for (const [least, width] of [[MINUTE_MS, 1.5], [10000, 4]]) {
    const points = samples.filter((one) => view.time - one.at <= least).map((one) => [one.at, ...at(one.x, one.y)]);
    if (points.length) into.push(svg("path", { class: "trail", "stroke-width": width, d: path(points, gap) }));
  }
}

/** Tone of something on the map; what is as it should be is the clearer the more it matters. */
const hue = (thing) => (tone(thing.sign) !== "normal" ? tone(thing.sign) : thing.body ? "strong" : "normal");

/** A unit with its heading, a track, or the place of one that has gone. */
function symbol(into, thing, x, y) {
  if (thing.chosen) into.push(svg("circle", { class: "chosen", cx: x, cy: y, r: thing.body ? 16 : 11 }));
  if (!thing.body) return into.push(svg("text", { class: `symbol ${hue(thing)}`, x, y: y + 5, "text-anchor": "middle" }, thing.passed ? "✕" : shape(thing.sign)));
  const turn = (-thing.yaw * 180) / Math.PI;
  return into.push(svg("path", { class: `body ${hue(thing)}`, d: "M12 0L-9 8L-5 0L-9 -8Z", transform: `translate(${x.toFixed(1)} ${y.toFixed(1)}) rotate(${turn.toFixed(1)})` }));
}

function label(into, places, thing, x, y) {
  const long = thing.name + (thing.over || "");
  let text = long, found = places.find(x, y, long, thing.body);
  if (!found && thing.over) [text, found] = [thing.name, places.find(x, y, thing.name)];
  if (!found) return false;
  if (found.leader) into.push(svg("path", { class: "leader", d: `M${x} ${y}L${found.leader.join(" ")}` }));
  into.push(svg("text", { class: hue(thing), x: found.x, y: found.y, "text-anchor": found.anchor }, text));
  return true;
}

/** What may be where: around each place the circle in which it may be by now, its age times the greatest speed. */
function map(view, chosen) {
  const place = byId("map"), all = things(view, chosen);
  const width = Math.max(place.clientWidth, 200), height = Math.max(place.clientHeight, 150);
  const to = projection(all, width, height), drawn = [];
  let circles = 0;
  const step = grid(drawn, to, width, height);
  if (site) drawn.push(...planned(site, to.at));
  for (const of of view.picture.units) trail(drawn, of.unit, view, to.at);
  const places = labeller(width, height), sites = all.map((thing) => to.at(thing.x, thing.y));
  sites.forEach(([x, y]) => places.take(x, y, 8));
  // Some places of each trail, so that a label leaves it free where it can.
  for (const { samples } of heard.values()) samples.filter((one, n) => n % 5 === 0).forEach((one) => places.take(...to.at(one.x, one.y), 3));
  // Units come first, and so are drawn last, above what they see.
  [...all].reverse().forEach((thing, n) => {
    const [x, y] = sites[all.length - 1 - n];
    const may = thing.passed || thing.age === null ? 0 : Math.min((thing.age / 1000) * view.picture.max_speed_mm_s, MAY_MM) * to.scale;
    if (may > 6) circles += drawn.push(svg("circle", { class: `may ${tone(thing.sign)}`, cx: x, cy: y, r: may.toFixed(1) }));
    symbol(drawn, thing, x, y);
  });
  const left = all.filter((thing, n) => !(thing.passed && !thing.chosen) && !label(drawn, places, thing, ...sites[n])).length;
  place.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const worse = all.filter((thing) => thing.word !== "fresh" && !thing.passed).length;
  place.setAttribute("aria-label", `map: ${view.picture.units.length} units, ${all.length - view.picture.units.length} tracks, ${worse} not fresh`);
  put(place, ...drawn);
  const keys = [`grid ${step} m`, site && site.fence.length ? "dashes: fence" : "", site && site.route.length ? "thin line: route" : "", "trail 60 s, thick 10 s"];
  keys.push(circles ? "dashed circle: it may be anywhere in it" : "", all.some((thing) => thing.passed) ? "✕ out of view" : "", left ? `${left} labels left out` : "");
  tell("legend", keys.filter(Boolean).join(" · "));
}

/** Longest time between two samples that one line joins: where a value would be stale, nothing was heard. */
const gapOf = (view) => (view.picture.limits_ms ? view.picture.limits_ms.late : 500);

/** The plots of a unit: name, value now, points, limits [value, words] and the top of the scale. */
function plotsOf(of, state, view) {
  const { samples, ages } = heard.get(of.unit) || { samples: [], ages: [] };
  const { picture } = view, was = state.current ? "" : "was ";
  const points = (value) => samples.map((one) => [one.at, value(one)]).filter((point) => isKnown(point[1] === undefined ? null : point[1]));
  const speed = state.value.speed_mm_s / 1000, most = picture.max_speed_mm_s / 1000, room = roomOf(state);
  const plots = [{ name: "Speed", value: `${was}${tenths(speed)} m/s`, points: points((one) => one.speed), limits: [[most, `most ${most}`]] }];
  plots.push({ name: "Age of report", value: atMost(state.age), points: ages.filter((one) => isKnown(one.age)).map((one) => [one.at, one.age / 1000]), limits: [] });
  if (picture.limits_ms) {
    const { fresh, late } = picture.limits_ms;
    Object.assign(plots[1], { limits: [[fresh / 1000, `late ${fresh / 1000}`], [late / 1000, `stale ${late / 1000}`]], top: (late / 1000) * 1.3 });
  }
  if (room !== null) plots.push({ name: "Room to the fence", value: `${was}${tenths(room)} m`, points: points((one) => one.room), limits: [[0, "stop 0"]] });
  if (view.track !== null) {
    const sure = of.tracks.find((each) => each.value.id === view.track);
    plots.push({ name: `Confidence, track ${view.track}`, value: sure ? `${was}${(sure.value.confidence_permille / 1000).toFixed(2)}` : "not reported", points: points((one) => one.sure.get(view.track)), limits: of.state.value.settings ? [[of.state.value.settings.arm_permille / 1000, `arm ${of.state.value.settings.arm_permille / 1000}`]] : [], top: 1 });
  }
  return plots;
}

/** Changes of mode in the last minute: [at, mode]. */
function changes(name) {
  const { samples } = heard.get(name) || { samples: [] };
  return samples.filter((one, n) => n > 0 && one.mode !== samples[n - 1].mode).map((one) => [one.at, one.mode]);
}

const modeTone = (mode) => (mode === "HOLD_SAFE" || mode === "DEGRADED" ? "caution" : "weak");
const RIGHT = 84; // room for the words of limits

function line(plot, view, width, height, events) {
  const span = [...plot.points.map((point) => point[1]), ...plot.limits.map((limit) => limit[0])];
  const [low, high] = [Math.min(0, ...span), plot.top || Math.max(...span, 0.1) * 1.1];
  const x = (at) => (width - RIGHT) * (1 - (view.time - at) / MINUTE_MS);
  const y = (value) => 4 + (height - 8) * (1 - (Math.min(value, high) - low) / (high - low || 1));
  const drawn = [svg("path", { class: "grid", d: [1, 2, 3, 4, 5, 6].map((n) => `M${((width - RIGHT) * n) / 6} 0V${height}`).join("") })];
  for (const [value, words] of plot.limits) {
    drawn.push(svg("path", { class: "limit", d: `M0 ${y(value)}H${width - RIGHT}` }));
    drawn.push(svg("text", { class: "axis", x: width - RIGHT + 5, y: Math.min(Math.max(y(value) + 5, 12), height - 2) }, words));
  }
  for (const [at, mode] of events) if (x(at) >= 0) drawn.push(svg("path", { class: `event ${modeTone(mode)}`, d: `M${x(at).toFixed(1)} 0V${height}` }));
  const points = plot.points.filter(([at]) => x(at) >= 0 && at <= view.time).map(([at, value]) => [at, x(at), y(value)]);
  if (points.length) drawn.push(svg("path", { class: "line", d: path(points, gapOf(view)) }));
  return drawn;
}

/** Times below the plots, and what happened, the newest first; what would collide is left out. */
function axis(view, width, events) {
  const drawn = [-60, -40, -20, 0].map((s, n) => svg("text", { class: "axis", x: ((width - RIGHT) * n) / 3, y: 13, "text-anchor": n === 0 ? "start" : "middle" }, s ? `−${-s} s` : "now"));
  let free = width;
  for (const [at, mode] of [...events].reverse()) {
    const x = (width - RIGHT) * (1 - (view.time - at) / MINUTE_MS), long = mode.length * 8;
    const right = Math.min(Math.max(x + long / 2, long), width);
    if (x < 0 || right > free) continue;
    free = right - long - 8;
    drawn.push(svg("text", { class: modeTone(mode), x: right, y: 31, "text-anchor": "end" }, mode));
  }
  return drawn;
}

/** A drawing as wide as its place. */
function strip(attributes, content) {
  const there = document.querySelector(attributes.class ? `#plots .${attributes.class}` : "#plots svg");
  const width = Math.max((there && there.clientWidth) || 300, 160), height = Math.max((there && there.clientHeight) || 36, 36);
  const made = svg("svg", { ...attributes, viewBox: `0 0 ${width} ${height}` });
  made.append(...content(width, height));
  return made;
}

function plots(of, state, view) {
  const events = changes(of.unit);
  const rows = plotsOf(of, state, view).map((plot) => element("div", { class: "plot" },
    element("p", {}, element("span", { class: "note" }, plot.name), " ", element("strong", {}, plot.value)),
    strip({ role: "img", "aria-label": `${plot.name} over the last 60 s, ${plot.value}` }, (width, height) => line(plot, view, width, height, events))));
  const below = strip({ "aria-hidden": "true", class: "times" }, (width) => axis(view, width, events));
  put(byId("plots"), ...rows, element("div", { class: "plot" }, element("p", {}), below));
}
