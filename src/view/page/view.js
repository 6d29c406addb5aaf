/* SPDX-License-Identifier: Apache-2.0 */
// view.js -- the page put together: controls to camera, camera to pictures, pictures to canvases.
import { Camera, sub } from "./camera.js";
import { Lines, roundBelow } from "./lines.js";
import { difference, paintOutput, ramp, rangeOf, takeMarks } from "./paint.js";
import { Pictures } from "./pictures.js";
import { Training } from "./training.js";
import { findSubject } from "./subject.js";
import { listen } from "./hands.js";
import { copyText, savePicture } from "./keep.js";

const byId = id => document.getElementById(id);
const chosen = name => document.querySelector(`input[name=${name}]:checked`).value;
const words = new URLSearchParams(location.search);
if (words.has("token")) // the server has made a cookie of it
    history.replaceState(null, "", location.pathname);
const camera = new Camera();
const look = {
    scene: null, subject: null, view: -1, photo: null, marks: null, noPhoto: "", split: 0.5, // what there is, and beside what; why there is no photo
    done: null, about: null, first: null, sum: null, values: null, range: null, psnr: null, pointed: undefined, // what is shown
};

// ---- sizes ---------------------------------------------------------------------------------------------------------------------

const windowPixelsMax = 1 << 21, pixelsMax = 1 << 23, sideMax = 8192, gap = 12;

function photoSize() {
    const view = look.scene.views[look.view];
    return [view.width, view.height];
}

// Where pictures go: the stage, or the photo's half of it and the render's, one above the other where it is higher
// than wide. In pixels of the screen.
function rooms() {
    const { width, height } = byId("stage").getBoundingClientRect(), two = compareMode() === "beside", below = two && height > width;
    const size = [two && !below ? (width - gap) / 2 : width, below ? (height - gap) / 2 : height];
    const scaled = ([x, y]) => [x, y].map(n => Math.max(0, Math.floor(n * window.devicePixelRatio)));
    return { size: scaled(size).map(n => Math.max(1, n)), render: scaled([two && !below ? size[0] + gap : 0, below ? size[1] + gap : 0]) };
}

// Beside its photo a picture has the photo's size, up to pixelsMax, so that pixels can be compared. Alone it fills the window: in the photo's
// shape where it has the photo's camera, else all of it.
function pictureSize() {
    const size = look.view < 0 ? "window" : byId("size").value, fills = size === "window" && compareMode() === "off"; // or "480x640", or a factor
    let [width, height] = fills ? rooms().size : size.includes("x") ? size.split("x").map(Number) : photoSize().map(n => n * (Number(size) || 1));
    const shape = camera.model === "equirectangular" ? 2 : fills && camera.view >= 0 ? camera.aspect : width / height;
    [width, height] = [Math.min(width, height * shape), Math.min(height, width / shape)];
    const fit = Math.min(1, sideMax / Math.max(width, height), Math.sqrt((fills ? windowPixelsMax : pixelsMax) / (width * height)));
    return [width, height].map(n => Math.max(1, Math.floor(n * fit + 1e-6))); // rounding may leave it just below a whole number
}

function fillSizes() {
    const [width, height] = photoSize(), old = byId("size").value;
    const options = [0.5, 1, 2].map(n => new Option(`${Math.floor(width * n)} × ${Math.floor(height * n)}`, n));
    byId("size").replaceChildren(new Option("window", "window"), ...options);
    byId("size").value = old || "window";
}

// A box of a picture's shape in the middle of a room, as large as it fits, in whole pixels of the screen.
function putInto([room, high], [x, y], box, width, height) {
    const fit = Math.min(room / width, high / height), w = Math.round(width * fit), h = Math.round(height * fit), scale = window.devicePixelRatio;
    const place = { left: x + Math.floor((room - w) / 2), top: y + Math.floor((high - h) / 2), width: w, height: h };
    for (const name in place)
        box.style[name] = `${place[name] / scale}px`;
    return place;
}

// For the picture that is shown now: the one that was asked for may have another shape.
function layout() {
    const stage = byId("stage"), mode = compareMode(), two = mode === "beside", room = rooms(), scale = window.devicePixelRatio;
    const shot = look.done !== null ? look.done.shot : null, size = shot !== null ? [shot.width, shot.height] : pictureSize();
    const place = putInto(room.size, room.render, byId("render-box"), ...size);
    putInto(room.size, [0, 0], byId("photo-box"), ...(look.view >= 0 ? photoSize() : size));
    stage.classList.toggle("two", two || mode === "slider");
    stage.classList.toggle("slider", mode === "slider");
    byId("photo-box").hidden = !(two || mode === "slider") || look.photo === null;
    byId("photo-box").style.clipPath = mode === "slider" ? `inset(0 ${100 * (1 - look.split)}% 0 0)` : "none";
    const handle = byId("handle"), at = { left: place.left + place.width * look.split, top: place.top, height: place.height };
    handle.hidden = mode !== "slider";
    for (const name in at)
        handle.style[name] = `${at[name] / scale}px`;
    handle.setAttribute("aria-valuenow", Math.round(100 * look.split));
}

// ---- what is asked for, what comes ------------------------------------------------------------------------------------------------

// A photo can lie over the render only where it can be read and the render has its camera.
function compareMode() {
    const mode = chosen("compare");
    return look.view < 0 || look.noPhoto !== "" ? "off" : mode === "beside" || camera.view === look.view ? mode : "off";
}

function cameraQuery(width, height) {
    return new URLSearchParams(camera.view >= 0 ? { view: camera.view, width, height } : { camera: JSON.stringify(camera.file(width, height)) });
}

const lacksPhoto = () => compareMode() === "difference" && look.photo === null; // it will come

function wanted() {
    if (look.scene === null || lacksPhoto())
        return null;
    const [width, height] = pictureSize(), output = chosen("output"), color = output === "color", alone = compareMode() === "off";
    const query = (w, h) => {
        const q = cameraQuery(w, h);
        q.set("preset", byId("preset").value);
        q.set("output", output);
        q.set("renderer", color ? byId("renderer").value : "trace");
        q.set("format", color ? byId("transfer").value : "float");
        if (alone && byId("background").value !== "") // beside a photo: what was trained
            q.set("background", byId("background").value);
        return q;
    };
    const samples = color && byId("live").hidden ? Number(byId("samples").value) : 1;
    const small = byId("moving").value === "auto", bounded = small && alone && (look.view < 0 || byId("size").value === "window");
    return { query, output, width, height, samples, small, bounded, shot: camera.file(width, height) };
}

async function pixelsOf({ about, bytes, type }) {
    if (!type.startsWith("image/"))
        return new Uint8ClampedArray(bytes);
    const bitmap = await createImageBitmap(new Blob([bytes], { type }));
    const canvas = new OffscreenCanvas(about.width, about.height), context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(bitmap, 0, 0);
    return context.getImageData(0, 0, about.width, about.height).data;
}

// The mean of the samples so far; the first one is the picture itself.
function average(pixels, done) {
    if (done.samples === 1) {
        look.first = pixels, look.sum = null;
        return pixels;
    }
    if (look.sum === null)
        look.sum = Float32Array.from(look.first);
    const out = new Uint8ClampedArray(pixels.length), sum = look.sum, share = 1 / done.samples;
    for (let i = 0; i < out.length; i++)
        out[i] = (sum[i] += pixels[i]) * share;
    return out;
}

async function show(picture, done) {
    if (lacksPhoto())
        return;
    const { about, bytes } = picture, output = done.output, canvas = byId("render");
    let pixels;
    look.values = null, look.range = null, look.pointed = undefined;
    if (output !== "color") {
        const values = new Float32Array(bytes);
        pixels = new Uint8ClampedArray(4 * about.width * about.height);
        look.range = paintOutput(output, values, pixels, output === "transmittance" ? [0, 1] : rangeOf(values));
        look.values = { output, values, channels: about.channels, width: about.width, height: about.height };
    } else {
        pixels = average(await pixelsOf(picture), done);
    }
    if (canvas.width !== about.width || canvas.height !== about.height)
        canvas.width = about.width, canvas.height = about.height;
    let seen = pixels;
    look.psnr = null;
    if (compareMode() === "difference" && look.values === null) {
        seen = new Uint8ClampedArray(pixels.length);
        const marks = look.photo.width === about.width && look.photo.height === about.height ? look.marks : null;
        look.psnr = difference(pixels, photoPixels(about.width, about.height), marks, seen);
    }
    canvas.getContext("2d").putImageData(new ImageData(seen, about.width, about.height), 0, 0);
    look.about = about, look.done = done;
    layout();
    drawLines();
    byId("message").hidden = true;
    byId("legend").hidden = look.range === null;
    if (look.range !== null)
        [byId("low").textContent, byId("high").textContent] = look.range.map(v => Number(v.toPrecision(3)));
    requestAnimationFrame(() => describe(about, done));
}

function drawLines() {
    const { scene, subject, view } = look;
    if (look.done !== null)
        lines.draw(look.done.shot, { grid: byId("grid").checked, cameras: byId("cameras").checked }, { ...scene, subject, view });
}

function describe(about, done) {
    const parts = [`${about.width} × ${about.height}`];
    if (pictures.perSecond() >= 1 && performance.now() - pictures.movedAt < 1000)
        parts.push(`${pictures.perSecond().toFixed(0)} pictures/s`);
    if (done.samples > 1)
        parts.push(`${done.samples} rays/pixel`);
    if (look.psnr !== null)
        parts.push(`${look.psnr.toFixed(2)} dB`);
    if (look.pointed !== undefined)
        parts.push(look.pointed);
    if (byId("grid").checked)
        parts.push(`grid of ${roundBelow(look.subject.radius / 2)}`);
    const ms = [about.total_ms, about.prepare_ms, about.trace_ms, about.encode_ms + about.transfer_ms, about.draw_ms].map(t => Math.max(t, 0).toFixed(0));
    const more = document.createElement("span");
    more.className = "more"; // where there is room
    more.textContent = ` · ${ms[0]} ms (prepare ${ms[1]}, trace ${ms[2]}, send ${ms[3]}, draw ${ms[4]})`;
    byId("numbers").replaceChildren(parts.join(" · "), more);
}

function fail(error) {
    byId("message").textContent = error.message;
    byId("message").hidden = false;
}

const pictures = new Pictures(wanted, show, error => training.gone || fail(error)), lines = new Lines(byId("lines"));

function showControls() {
    const left = look.view >= 0 && look.noPhoto === "" && chosen("compare") !== "off" && compareMode() === "off", fov = camera.fovOf(...pictureSize());
    const compares = compareMode() !== "off" && pictureSize().join() === photoSize().join();
    byId("compare-note").textContent = left ? "The camera has left the photo: R goes back." : compares ? "Of the photo's size, pixel for pixel." : look.noPhoto;
    byId("model").value = camera.view >= 0 ? "photo" : camera.model;
    byId("copy-note").hidden = camera.view < 0 || camera.model === "equirectangular";
    byId("copy-note").textContent = `The copy is a ${camera.model} like the photo's lens, without its centre and distortion.`;
    byId("fov-row").hidden = camera.view >= 0 || camera.model === "equirectangular";
    byId("fov").max = camera.model === "fisheye" ? 360 : 150;
    byId("fov").value = fov;
    byId("fov-shown").textContent = `${Math.round(fov)}°`;
    byId("speed-shown").textContent = `× ${Number((2 ** byId("speed").value).toPrecision(2))}`;
}

function changed(moving = false) {
    layout();
    showControls();
    pictures.change(moving);
}

// ---- photos --------------------------------------------------------------------------------------------------------------------

function photoPixels(width, height) {
    const canvas = new OffscreenCanvas(width, height), context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(look.photo, 0, 0, width, height);
    return context.getImageData(0, 0, width, height).data;
}

async function readPhoto(view) {
    const response = await fetch(`photo?view=${view}&format=${byId("transfer").value}`);
    if (!response.ok)
        throw new Error((await response.text()).trim());
    const about = JSON.parse(response.headers.get("X-Picture")), type = response.headers.get("Content-Type");
    return new ImageData(await pixelsOf({ about, bytes: await response.arrayBuffer(), type }), about.width, about.height);
}

async function fetchPhoto(view) {
    const [photo, why] = await readPhoto(view).then(photo => [photo, ""], error => [null, `No photo: ${error.message.replace(/^error: /, "")}`]);
    if (view !== look.view)
        return;
    const canvas = byId("photo"), mode = compareMode();
    look.photo = photo !== null ? canvas : null, look.noPhoto = why;
    if (photo !== null) {
        look.marks = takeMarks(photo.data);
        canvas.width = photo.width, canvas.height = photo.height;
        canvas.getContext("2d").putImageData(photo, 0, 0);
    }
    if (compareMode() === "difference" || compareMode() !== mode)
        return changed();
    layout(); // the picture is the same
    showControls();
}

// Whether two scenes have the same photo where one is looked at; its pose may be refined meanwhile.
function hasSamePhoto(a, b) {
    const of = scene => ["name", "width", "height", "lens"].map(key => scene.views[look.view]?.[key]).join();
    return a.input === b.input && of(a) === of(b);
}

// The lens of a camera file that comes nearest to one of a data set. Its scale in the middle is the photo's: fov_x_deg is a pinhole's with it.
function takeLens(view) {
    const fisheye = view.lens.includes("FISHEYE"), radian = Math.PI / 180;
    camera.model = view.lens === "EQUIRECTANGULAR" ? "equirectangular" : fisheye ? "fisheye" : "pinhole";
    camera.fov = fisheye ? Math.min(360, 2 * Math.tan(view.fov_x_deg / 2 * radian) / radian) : view.fov_x_deg;
    camera.aspect = view.width / view.height;
}

function goTo(index) {
    const view = look.scene.views[index];
    const other = look.view !== index || look.noPhoto !== "";
    look.view = index;
    camera.place(view.camera, look.subject.middle);
    camera.view = index;
    takeLens(view);
    byId("view").value = index;
    if (other) {
        look.photo = null, look.noPhoto = "";
        fillSizes();
        fetchPhoto(index);
    }
    changed();
}

const step = by => look.scene !== null && look.scene.views.length > 0 && goTo((look.view + by + look.scene.views.length) % look.scene.views.length);

function fillViews(scene) {
    const group = (label, test) => {
        const g = document.createElement("optgroup");
        g.label = label;
        scene.views.forEach((v, i) => v.test === test && g.append(new Option(v.name, i)));
        return g;
    };
    byId("view").replaceChildren(...[group("held out", true), group("trained on", false)].filter(g => g.children.length > 0));
    for (const part of document.querySelectorAll(".of-photos"))
        part.hidden = scene.views.length === 0;
}

// ---- the scene, first and again ----------------------------------------------------------------------------------------------------

function firstLook() {
    const { scene, subject } = look;
    camera.level = scene.up;
    if (scene.views.length > 0)
        return goTo(Math.max(0, scene.views.findIndex(v => v.test)));
    camera.place({ origin: sub(subject.middle, [0, 0, 1]), target: subject.middle, up: scene.up }, subject.middle);
    camera.fit(subject);
    changed();
}

async function statusChanged(status) {
    if (status === null)
        return fail(new Error("gbtrace view has ended; start it again to go on."));
    if (status.version === 0)
        return fail(new Error(status.note));
    const response = await fetch("scene");
    if (!response.ok)
        throw new Error((await response.text()).trim());
    const scene = await response.json(), first = look.scene === null || !hasSamePhoto(look.scene, scene);
    look.scene = scene;
    look.subject = findSubject(scene);
    byId("title").textContent = scene.input.replace(/\/+$/, "").split("/").pop() || scene.input;
    document.title = `${byId("title").textContent} – gbtrace`;
    const facts = scene.plain ? [`${scene.gaussians.toLocaleString("en")} Gaussians`] : [`${scene.anchors.toLocaleString("en")} anchors`, `step ${status.iterations}`];
    byId("facts").textContent = facts.concat(status.note || []).join(" · ");
    byId("facts").title = byId("facts").textContent;
    byId("part-name").textContent = scene.plain ? "Gaussians" : "anchors";
    fillViews(scene);
    if (first) {
        look.view = camera.view = -1, look.photo = null, look.noPhoto = "";
        byId("renderer").value = scene.renderer;
        firstLook();
    } else {
        byId("view").value = look.view;
        if (look.view >= 0)
            fetchPhoto(look.view); // of the same name; it may be another one after all
        changed();
    }
}

// ---- controls ------------------------------------------------------------------------------------------------------------------

// The camera is free from now on, with the lens that comes nearest to the photo's.
function leave() {
    camera.view = -1;
}

function pixelAt(event) {
    const box = byId("render").getBoundingClientRect(), [width, height] = pictureSize();
    const x = (event.clientX - box.left) / box.width, y = (event.clientY - box.top) / box.height;
    return x >= 0 && x < 1 && y >= 0 && y < 1 ? { x, y, width, height } : null;
}

async function pick(event) {
    const at = pixelAt(event);
    if (at === null || look.scene === null)
        return;
    const query = cameraQuery(at.width, at.height), stage = byId("stage").getBoundingClientRect(), ring = byId("ring");
    query.set("x", (at.x * at.width).toFixed(3));
    query.set("y", (at.y * at.height).toFixed(3));
    const response = await fetch("pick?" + query);
    const found = response.ok ? await response.json() : { hit: false };
    if (!found.hit)
        return;
    camera.pivot = found.point;
    Object.assign(ring.style, { left: `${event.clientX - stage.left}px`, top: `${event.clientY - stage.top}px` });
    ring.hidden = true;
    requestAnimationFrame(() => ring.hidden = false);
}

// The photo whose camera is pointed at gets its name shown.
function nameCamera(event) {
    const view = look.scene.views[lines.cameraAt(event.clientX, event.clientY)], stage = byId("stage").getBoundingClientRect(), name = byId("name");
    byId("stage").classList.toggle("over-camera", view !== undefined);
    name.hidden = view === undefined;
    name.textContent = view !== undefined ? view.name : "";
    Object.assign(name.style, { left: `${event.clientX - stage.left}px`, top: `${event.clientY - stage.top}px` });
}

function pointAt(event) {
    if (look.about === null)
        return;
    nameCamera(event);
    const at = pixelAt(event), v = look.values;
    look.pointed = undefined;
    if (at !== null && v !== null) {
        const i = v.channels * (Math.floor(at.y * v.height) * v.width + Math.floor(at.x * v.width));
        const some = Array.from(v.values.slice(i, i + v.channels), x => Number(x.toPrecision(4)));
        look.pointed = `${v.output === "anchor" ? byId("part-name").textContent.replace(/s$/, "") : v.output} ${some.join(" ")}`;
    }
    describe(look.about, look.done);
}

// "folder/a.jpg" shown as depth is kept as "folder_a.depth.png".
function pictureName() {
    const view = look.scene.views[camera.view], output = look.done.output;
    return (view ? view.name.replace(/\.[^.]*$/, "").replaceAll("/", "_") : "picture") + (output === "color" ? "" : "." + output) + ".png";
}

const moved = () => {
    leave();
    changed(true);
};

// Of the scene, at the pivot, under a pixel of the page; and radians.
const unitsPerPixel = () => camera.viewWidth(...pictureSize()) / byId("render").clientWidth;
const radiansPerPixel = () => camera.fovOf(...pictureSize()) * Math.PI / 180 / byId("render").clientWidth;

function fly(right, up, forward) { // half of the subject's radius in a second
    if (look.subject === null || right === 0 && up === 0 && forward === 0) // W and S together
        return;
    const speed = 0.5 * look.subject.radius * 2 ** byId("speed").value;
    camera.move(right * speed, up * speed, forward * speed);
    moved();
}

function clickAt(event) {
    const view = lines.cameraAt(event.clientX, event.clientY);
    if (view >= 0)
        goTo(view);
}

const toggle = id => () => byId(id).click();
const keys = {
    "[": () => step(-1), "]": () => step(1), r: () => look.view >= 0 && goTo(look.view), h: () => look.scene !== null && firstLook(),
    f: () => { if (look.scene !== null) { camera.fit(look.subject); leave(); changed(); } },
    g: toggle("grid"), c: () => look.view >= 0 && byId("cameras").click(), "?": () => byId("help").showModal(),
};
listen(byId("stage"), {
    orbit: (x, y) => { camera.orbit(-2 * Math.PI * x, -Math.PI * y, camera.pivot); moved(); },
    around: (x, y) => { camera.orbit(radiansPerPixel() * x, radiansPerPixel() * y, camera.eye); moved(); },
    shift: (x, y) => { camera.move(-x * unitsPerPixel(), y * unitsPerPixel(), 0); moved(); },
    zoom: factor => {
        if (look.subject === null || factor === 1)
            return;
        const far = camera.distance() / look.subject.radius; // beyond these, rounding would hold it there
        if (factor > 1 ? far < 1e6 : far > 1e-4) {
            camera.zoom(factor);
            moved();
        }
    },
    split: share => { look.split = share; layout(); },
    fly, pick, click: clickAt, point: pointAt, keys,
}, byId("handle"), byId("render-box"), document.querySelector("aside"));

for (const [id, key] of [["home", "h"], ["fit", "f"], ["back", "r"], ["help-button", "?"]])
    byId(id).addEventListener("click", keys[key]);
byId("view").addEventListener("change", () => goTo(Number(byId("view").value)));
byId("previous").addEventListener("click", () => step(-1));
byId("next").addEventListener("click", () => step(1));
byId("save").addEventListener("click", () => look.done !== null && savePicture(byId("render"), pictureName()));
byId("copy").addEventListener("click", () => copyText(byId("copy"), JSON.stringify(camera.file(...pictureSize()), null, 1)));
byId("model").addEventListener("change", () => {
    leave();
    camera.model = byId("model").value;
    camera.fov = Math.min(camera.fov, camera.model === "fisheye" ? 360 : 150);
    changed();
});
byId("fov").addEventListener("input", () => {
    const [width, height] = pictureSize();
    camera.fov = Number(byId("fov").value), camera.aspect = width / height; // the frame is what the picture shows
    moved();
});
for (const id of ["compare", "output", "size", "background", "renderer", "preset", "moving", "samples", "transfer"])
    byId(id).addEventListener("change", () => changed());
for (const id of ["grid", "cameras"])
    byId(id).addEventListener("change", () => {
        drawLines();
        if (look.about !== null)
            describe(look.about, look.done);
    });
byId("transfer").addEventListener("change", () => look.view >= 0 && fetchPhoto(look.view));
byId("speed").addEventListener("input", showControls);
new ResizeObserver(() => look.subject !== null && changed()).observe(byId("stage"));
function followPixelRatio() { // another screen, another number of pixels for the same stage
    matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener("change", () => {
        if (look.subject !== null)
            changed();
        followPixelRatio();
    }, { once: true });
}
followPixelRatio();

const rampData = new ImageData(256, 1);
ramp.forEach((c, i) => rampData.data.set([...c, 255], 4 * i));
byId("ramp").getContext("2d").putImageData(rampData, 0, 0);
const training = new Training(byId("training-part"), byId("training-now"), byId("chart"), byId("live"), status => statusChanged(status).catch(error => { training.version = -1; fail(error); }));
window.gbtrace = { camera, look, pictures, lines, training, changed }; // for the console, and for tests
