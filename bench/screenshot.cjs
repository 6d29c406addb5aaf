/* SPDX-License-Identifier: Apache-2.0 */
// screenshot -- a page as a headless Chromium shows it: node bench/screenshot.cjs MODULES URL WIDTHxHEIGHT OUT.png [CLICK]
// MODULES: the folder into which bench/viewers has put its packages; CLICK: a CSS selector of what is clicked first.
const [modules, url, size, out, click] = process.argv.slice(2);
const puppeteer = require(modules + "/node_modules/puppeteer-core");
const {execSync} = require("node:child_process");

(async () => {
    const [width, height] = size.split("x").map(Number);
    const executablePath = execSync("command -v chromium || command -v chromium-browser || command -v google-chrome", {encoding: "utf8"}).trim();
    const browser = await puppeteer.launch({executablePath, args: ["--no-sandbox", "--hide-scrollbars"]});
    const page = await browser.newPage();
    await page.setViewport({width, height});
    await page.goto(url, {waitUntil: "load"});
    await new Promise((done) => setTimeout(done, 3000));
    if (click) {
        await page.evaluate((selector) => document.querySelector(selector).click(), click);
        await new Promise((done) => setTimeout(done, 4000)); // a viewer refines its picture while nothing moves
    }
    await page.screenshot({path: out});
    await browser.close();
})();
