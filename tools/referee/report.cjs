// A report (`holdsafe report`) in headless Chromium, at three widths, light and dark, and printed: whether it leads with its finding, is whole,
// asks for nothing and can be read.
// Takes the two images of docs/reviewer/report. Needs npm's `playwright-core` and `axe-core` (NODE_PATH) and a Chromium.
//
//   NODE_PATH=… node tools/referee/report.cjs report.html /usr/bin/chromium FOLDER-FOR-IMAGES
"use strict";
const { chromium } = require("playwright-core");
const fs = require("fs");
const path = require("path");
const { pathToFileURL } = require("url");

const [file, browserPath, images] = process.argv.slice(2);
const at = pathToFileURL(path.resolve(file)).href;
const axe = fs.readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
let bad = 0;
function check(holds, what) {
  console.log(`${holds ? "ok  " : "FAIL"} ${what}`);
  bad += holds ? 0 : 1;
}

// Words that their box cuts off, and words of a drawing that lie over one another.
const CUT = `[...document.querySelectorAll("th, td, li, p, h1, h2, h3, summary, figcaption")]
  .filter((e) => e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).overflowX === "hidden").map((e) => e.textContent.slice(0, 40))`;
const OVER = `[...document.querySelectorAll("svg")].flatMap((svg) => {
  const words = [...svg.querySelectorAll("text")].map((e) => [e, e.getBoundingClientRect()]).filter(([, r]) => r.width > 0);
  const apart = (a, b) => a.right <= b.left + 1 || b.right <= a.left + 1 || a.bottom <= b.top + 2 || b.bottom <= a.top + 2;
  return words.flatMap(([e, r], i) => words.slice(i + 1).filter(([, s]) => !apart(r, s)).map(([f]) => e.textContent + " / " + f.textContent));
})`;

// Words smaller than 13 pixels as they are drawn, and what stands before the finding.
const SMALL = `[...document.querySelectorAll("body *")].filter((e) => e.checkVisibility() && [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()))
  .map((e) => [e, parseFloat(getComputedStyle(e).fontSize) * (e.ownerSVGElement ? e.getScreenCTM().a : 1)])
  .filter(([, size]) => size < 12.7).map(([e, size]) => size.toFixed(1) + " " + e.textContent.slice(0, 30))`;
const FIRST = `(() => { const h1 = document.querySelectorAll("h1"); const box = h1[0] && h1[0].getBoundingClientRect();
  return h1.length === 1 && h1[0].textContent.trim().endsWith(".") && box.top >= 0 && box.bottom < innerHeight; })()`;
// Cells keep their grounds on paper, where a browser drops them unless it is told not to.
const TINTED = `[...document.querySelectorAll(".cell:not(.none), .dbar i, figure svg")].every((e) => getComputedStyle(e).printColorAdjust === "exact")`;

(async () => {
  const browser = await chromium.launch({ executablePath: browserPath, args: ["--no-sandbox"] });
  for (const [scheme, width] of ["light", "dark"].flatMap((scheme) => [1280, 1920, 390].map((width) => [scheme, width]))) {
    const context = await browser.newContext({ colorScheme: scheme, viewport: { width, height: 1060 } });
    const page = await context.newPage();
    const name = `${scheme}-${width}`;
    const errors = [];
    const elsewhere = [];
    page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
    page.on("pageerror", (error) => errors.push(String(error)));
    page.on("request", (request) => request.url() === at || request.url().startsWith("data:") || elsewhere.push(request.url()));
    await page.goto(at);
    check(await page.evaluate(FIRST), `${name}: one finding, a sentence, on the first screen`);
    if (width === 1280) {
      if (scheme === "dark" && (await page.locator("#runs").count())) await page.evaluate("document.querySelector('#runs').scrollIntoView()");
      await page.screenshot({ path: path.join(images, `${scheme}.png`) });
    }
    const small = await page.evaluate(SMALL);
    check(small.length === 0, `${name}: no words below 13 pixels ${JSON.stringify(small.slice(0, 5))}`);
    // What is folded away is looked at, too.
    await page.evaluate("document.querySelectorAll('details').forEach((e) => (e.open = true))");
    const found = await page.evaluate(`${axe};axe.run(document,{resultTypes:["violations"]}).then(r=>r.violations.map(v=>v.id+": "+v.nodes.map(n=>n.target).join(" ")))`);
    check(found.length === 0, `${name}: axe finds nothing ${JSON.stringify(found)}`);
    check(!(await page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth")), `${name}: nothing is wider than the page`);
    const cut = await page.evaluate(CUT);
    check(cut.length === 0, `${name}: no words are cut off ${JSON.stringify(cut)}`);
    const over = await page.evaluate(OVER);
    check(over.length === 0, `${name}: no words of a drawing lie over one another ${JSON.stringify(over)}`);
    check(elsewhere.length === 0, `${name}: no request elsewhere ${elsewhere}`);
    check(errors.length === 0, `${name}: no error ${errors}`);
  }
  const page = await (await browser.newContext({ viewport: { width: 720, height: 1000 } })).newPage();
  await page.goto(at);
  await page.emulateMedia({ media: "print" });
  check(await page.evaluate(TINTED), "print: tints stay");
  check(!(await page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth")), "print: nothing is wider than the paper");
  await browser.close();
  process.exit(bad ? 1 : 0);
})().catch((error) => {
  console.error(error);
  process.exit(1);
});
