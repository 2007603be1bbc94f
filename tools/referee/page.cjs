// The console's page (`holdsafe watch RUN --web`) in headless Chromium, over a live run: what it shows, what it does when pictures stop
// coming, and whether it asks for anything else. Needs npm's `playwright-core` and `axe-core` (NODE_PATH) and a Chromium.
//
//   NODE_PATH=… node tools/referee/page.cjs target/release/holdsafe /usr/bin/chromium FOLDER-FOR-IMAGES
"use strict";
const { chromium } = require("playwright-core");
const { spawn } = require("child_process");
const fs = require("fs");
const path = require("path");

const [program, browserPath, images] = process.argv.slice(2);
const out = fs.mkdtempSync("/tmp/holdsafe-page-");
const run = path.join(out, "run");
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
let bad = 0;
function check(holds, what) {
  console.log(`${holds ? "ok  " : "FAIL"} ${what}`);
  bad += holds ? 0 : 1;
}

async function address(watch) {
  let text = "";
  for await (const chunk of watch.stdout) {
    text += chunk;
    const found = text.match(/http:\S+/);
    if (found) return found[0];
  }
  throw new Error(`no address: ${text}`);
}

(async () => {
  const browser = await chromium.launch({ executablePath: browserPath, args: ["--no-sandbox"] });
  // The scenario, with time to look.
  fs.cpSync(path.join(__dirname, "../../scenarios"), path.join(out, "scenarios"), { recursive: true });
  const scenario = path.join(out, "scenarios", "perception", "thermal_loss.toml");
  const change = (file, before, after) => {
    const text = fs.readFileSync(file, "utf8");
    if (!text.includes(before)) throw new Error(`${file} has no ${before}`);
    fs.writeFileSync(file, text.replace(before, after));
  };
  change(scenario, "[varies]", "duration_s = 70.0\n\n[varies]");
  change(scenario, "at_s = 4.0\nduration_s = 5.0", "at_s = 8.0\nduration_s = 62.0");
  const live = spawn(program, ["run", scenario, "--live", "--watch", "--out", run], { stdio: "ignore" });
  const ended = new Promise((done) => live.on("exit", done));
  const mouth = path.join(run, "inputs", "console.cbor");
  while (!fs.existsSync(mouth) || fs.statSync(mouth).size < 64) {
    if (live.exitCode !== null) throw new Error(`the run ended with ${live.exitCode} before its console began`);
    await wait(20);
  }
  const watch = spawn(program, ["watch", run, "--web"], { stdio: ["ignore", "pipe", "inherit"] });
  const at = await address(watch);
  const open = async (scheme, width) => {
    const context = await browser.newContext({ colorScheme: scheme, viewport: { width, height: 900 } });
    const page = await context.newPage();
    const seen = { errors: [], elsewhere: [] };
    page.on("console", (message) => message.type() === "error" && seen.errors.push(message.text()));
    page.on("pageerror", (error) => seen.errors.push(String(error)));
    page.on("request", (request) => request.url().startsWith(at) || request.url().startsWith("data:") || seen.elsewhere.push(request.url()));
    await page.goto(at);
    return { page, seen, name: `${scheme}-${width}` };
  };
  const views = [await open("dark", 1280)];
  const banner = (page) => page.locator("#banner").innerText();
  const until = async (page, what, test, ms = 15000) => {
    const from = Date.now();
    while (Date.now() - from < ms) {
      if (await test(page)) return check(true, `${what} (${Date.now() - from} ms)`);
      await wait(50);
    }
    check(false, `${what}: ${await banner(page)}`);
  };
  const first = views[0].page;
  await until(first, "the unit is READY and fresh", async (page) => /unit-a[^]*READY[^]*Fresh and verified/.test(await banner(page)));
  check(await first.locator("#current").isHidden(), "nothing says that it is not current");
  await until(first, "the map has the geofence and the route", async (page) => (await page.locator("#map path.fence").count()) === 1 && (await page.locator("#map path.route").count()) === 1);
  await until(first, "the lost thermal stage is shown as DEGRADED with its guard", async (page) => /DEGRADED[^]*Thermal camera/.test(await banner(page)) && /Thermal camera fails/.test(await page.locator("#guards").innerText()));
  await until(first, "the last minute has a line for each plot", async (page) => (await page.locator("#plots path.line").count()) >= 3);
  await first.screenshot({ path: path.join(images, "page.png") });
  watch.kill("SIGSTOP");
  await until(first, "when nothing more comes, the page says so", (page) => page.locator("#current").isVisible());
  await until(first, "and calls nothing fresh", async (page) => !/fresh|● ≤|● picture/i.test(await page.locator("body").innerText()));
  await until(first, "nor does it to who only hears it", async (page) => /^not current; unit-a was (READY|DEGRADED|HOLD_SAFE)$/.test(await page.locator("#said").textContent()));
  watch.kill("SIGCONT");
  await until(first, "when pictures come again, it is current again", (page) => page.locator("#current").isHidden());
  for (const [scheme, width] of [["light", 1280], ["dark", 390], ["light", 390], ["dark", 1920]]) views.push(await open(scheme, width));
  for (const { page, name } of views) await page.screenshot({ path: path.join(images, `page-${name}.png`), fullPage: true });
  for (const { page, seen, name } of views) {
    // axe runs in a world of its own: the page's policy lets nobody add a script.
    const found = await page.evaluate(`${fs.readFileSync(require.resolve("axe-core/axe.min.js"), "utf8")};axe.run(document,{resultTypes:["violations"]}).then(r=>r.violations.map(v=>v.id+": "+v.nodes.map(n=>n.target).join(" ")))`);
    check(found.length === 0, `${name}: axe finds nothing ${JSON.stringify(found)}`);
    const wider = await page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth");
    check(!wider, `${name}: nothing is wider than the page`);
    const cut = await page.evaluate(`[...document.querySelectorAll("button span, strong, td, th, li, p, h2, summary")].filter(e => e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).display !== "inline" && !e.classList.contains("unseen")).map(e => e.textContent)`);
    check(cut.length === 0, `${name}: no text is cut off ${JSON.stringify(cut)}`);
    check(seen.elsewhere.length === 0, `${name}: no request elsewhere ${seen.elsewhere}`);
    check(seen.errors.length === 0, `${name}: no error ${[...new Set(seen.errors)]}`);
  }
  await ended;
  await until(first, "after the run it says that it is not current", (page) => page.locator("#current").isVisible());
  watch.kill("SIGINT");
  await browser.close();
  fs.rmSync(out, { recursive: true });
  process.exit(bad ? 1 : 0);
})().catch((error) => {
  console.error(error);
  process.exit(1);
});
