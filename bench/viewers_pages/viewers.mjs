/* SPDX-License-Identifier: Apache-2.0 */
// Read and draw exported files with other programs; see bench/viewers.
import {execFileSync} from "node:child_process";
import fs from "node:fs";
import http from "node:http";
import path from "node:path";
import {fileURLToPath} from "node:url";

import puppeteer from "puppeteer-core";

import {count} from "./count.mjs";

const [gbtrace, browserPath, cameraPath, scene, work, model] = process.argv.slice(2);
const here = path.dirname(fileURLToPath(import.meta.url));
const camera = JSON.parse(fs.readFileSync(cameraPath, "utf8"));
const types = {".html": "text/html", ".js": "text/javascript", ".mjs": "text/javascript", ".wasm": "application/wasm"};
const endings = [".ply", ".compressed.ply", ".splat", ".spz", ".sog", ".glb"], files = endings.map((ending) => "scene" + ending);
const endingOf = (file) => file.slice("scene".length), flat = (file) => endingOf(file).replaceAll(".", "_").slice(1);
const viewers = [
    {name: "Babylon.js", page: "babylon.html", reads: files},
    {name: "Spark", page: "spark.html", reads: files.filter((file) => !file.endsWith(".glb"))},
    {name: "Spark, blur as 3DGS", page: "spark.html", reads: ["scene.ply"], options: {preBlurAmount: 0.3, blurAmount: 0}},
];

function run(...words) {
    return execFileSync(gbtrace, words, {encoding: "utf8", stdio: ["ignore", "pipe", "inherit"]});
}

// What a page may ask for: itself, installed modules, exported files.
function serve(request, response) {
    const name = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
    const place = name.startsWith("/modules/") ? path.join(here, "node_modules", name.slice(9)) : name.startsWith("/files/") ? path.join(work, name.slice(7)) : path.join(here, name);
    if (!fs.existsSync(place) || !fs.statSync(place).isFile()) {
        response.writeHead(404).end();
        return;
    }
    response.writeHead(200, {"Content-Type": types[path.extname(place)] ?? "application/octet-stream"});
    fs.createReadStream(place).pipe(response);
}

async function draw(browser, port, viewer, file) {
    const page = await browser.newPage();
    page.on("pageerror", (error) => console.error(`${viewer.name}, ${file}: ${error.message}`));
    page.setDefaultTimeout(600000);
    await page.goto(`http://localhost:${port}/${viewer.page}`);
    await page.waitForFunction("typeof draw === 'function'");
    const shown = await page.evaluate((...words) => draw(...words), `/files/${file}`, camera, [0, 0, 0], file.endsWith(".glb"), viewer.options ?? {});
    await page.close();
    const picture = path.join(work, `${viewer.name.replace(/[^A-Za-z0-9]+/g, "_")}_${flat(file)}.png`);
    fs.writeFileSync(picture, Buffer.from(shown.png.split(",")[1], "base64"));
    return {count: shown.count, picture};
}

// Our own pictures of what a file gives back; a .glb holds the floats of the .ply.
function ours(file, renderer) {
    const folder = path.join(work, `${flat(file)}_${renderer}`);
    run("render", path.join(work, file), "-o", folder, "--camera", cameraPath, "--renderer", renderer);
    return path.join(folder, path.basename(cameraPath, ".json") + ".png");
}

// The picture of the run from which the Gaussians were exported.
function modelPicture() {
    const folder = path.join(work, "model");
    run("render", model, "-o", folder, "--camera", cameraPath);
    return path.join(folder, path.basename(cameraPath, ".json") + ".png");
}

function difference(picture, own) {
    const figures = JSON.parse(run("compare", picture, own, "--json"));
    return `${figures.psnr.toFixed(1)} dB, ${figures.flip.toFixed(3)}`;
}

run("export", scene, ...files.map((file) => path.join(work, file)));
const server = http.createServer(serve).listen(0);
const browser = await puppeteer.launch({executablePath: browserPath, protocolTimeout: 1800000, args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]});
const whole = model === undefined ? null : modelPicture();
console.log("| file | bytes | Gaussians, degree | drawn by | to our splats: PSNR, FLIP | to our rays |" + (whole ? " to the run |" : ""));
console.log("|---|---|---|---|---|---|" + (whole ? "---|" : ""));
for (const file of files) {
    const inside = await count(path.join(work, file));
    const own = {};
    for (const renderer of ["raster", "trace"])
        own[renderer] = ours(file === "scene.glb" ? "scene.ply" : file, renderer);
    for (const viewer of viewers.filter((v) => v.reads.includes(file))) {
        let shown;
        try {
            shown = await draw(browser, server.address().port, viewer, file);
        } catch (error) {
            console.log(`| \`${endingOf(file)}\` | | ${inside.count}, ${inside.degree} | ${viewer.name} | fails: ${error.message.split("\n")[0]} | |`);
            continue;
        }
        console.log(`| \`${endingOf(file)}\` | ${fs.statSync(path.join(work, file)).size} | ${inside.count}, ${inside.degree} | ${viewer.name} (${shown.count}) | ` +
            `${difference(shown.picture, own.raster)} | ${difference(shown.picture, own.trace)} |` + (whole ? ` ${difference(shown.picture, whole)} |` : ""));
    }
}
await browser.close();
server.close();
