// view.js -- the page put together: controls to camera, camera to pictures, pictures to canvases.
import { Camera, add, length, meetingPoint, mul, sub, unit } from "./camera.js";
import { difference, paintOutput, ramp, rangeOf } from "./paint.js";
import { Pictures } from "./pictures.js";
import { Training } from "./training.js";
import { listen } from "./hands.js";
import { copyText, savePicture } from "./keep.js";

const byId = id => document.getElementById(id);
const chosen = name => document.querySelector(`input[name=${name}]:checked`).value;
const words = new URLSearchParams(location.search);
if (words.has("token")) // the server has made a cookie of it
    history.replaceState(null, "", location.pathname);
const camera = new Camera();
const look = {
    scene: null, view: -1, middle: [0, 0, 0], photo: null, split: 0.5, // what there is, and beside what
    done: null, about: null, first: null, sum: null, values: null, range: null, psnr: null, pointed: undefined, // what is shown
};

// ---- sizes ---------------------------------------------------------------------------------------------------------------------

function baseSize() {
    const view = look.scene.views[look.view];
    return view ? [view.width, view.height] : [640, 480];
}

function pictureSize() {
    const stage = byId("stage"), size = byId("size").value; // "window", "480x640" or a factor
    let [width, height] = baseSize().map(n => n * size);
    if (size === "window")
        [width, height] = [stage.clientWidth, stage.clientHeight];
    else if (size.includes("x"))
        [width, height] = size.split("x").map(Number);
    if (camera.model === "equirectangular")
        height = Math.min(width, height), width = 2 * height;
    const fit = Math.min(1, 8192 / Math.max(width, height), Math.sqrt((1 << 23) / (width * height)));
    return [Math.max(1, Math.floor(width * fit)), Math.max(1, Math.floor(height * fit))];
}

function fillSizes() {
    const [width, height] = baseSize(), old = byId("size").value;
    const options = [0.5, 1, 2].map(n => new Option(`${Math.floor(width * n)} × ${Math.floor(height * n)}`, n));
    byId("size").replaceChildren(...options, new Option("window", "window"));
    byId("size").value = old || (look.view < 0 || width * height > 600000 ? "window" : "1");
}

// The figures in the middle of the stage, as large as they fit.
function layout() {
    const stage = byId("stage"), mode = compareMode(), two = mode === "beside";
    const [width, height] = pictureSize();
    const room = two ? (stage.clientWidth - 12) / 2 : stage.clientWidth;
    const scale = Math.min(room / width, stage.clientHeight / height), w = width * scale, h = height * scale;
    const left = two ? (stage.clientWidth - 2 * w - 12) / 2 : (stage.clientWidth - w) / 2, top = (stage.clientHeight - h) / 2;
    const put = (box, x) => Object.assign(box.style, { left: `${x}px`, top: `${top}px`, width: `${w}px`, height: `${h}px` });
    put(byId("render-box"), two ? left + w + 12 : left);
    put(byId("photo-box"), left);
    stage.classList.toggle("two", two || mode === "slider");
    stage.classList.toggle("slider", mode === "slider");
    byId("photo-box").hidden = !(two || mode === "slider") || look.photo === null;
    byId("photo-box").style.clipPath = mode === "slider" ? `inset(0 ${100 * (1 - look.split)}% 0 0)` : "none";
    byId("handle").hidden = mode !== "slider";
    Object.assign(byId("handle").style, { left: `${left + w * look.split}px`, top: `${top}px`, height: `${h}px` });
    byId("handle").setAttribute("aria-valuenow", Math.round(100 * look.split));
}

// ---- what is asked for, what comes ------------------------------------------------------------------------------------------------

// A photo can lie over the render only where the render has its camera.
function compareMode() {
    const mode = chosen("compare");
    return look.view < 0 ? "off" : mode === "beside" || camera.view === look.view ? mode : "off";
}

function cameraQuery(width, height) {
    return new URLSearchParams(camera.view >= 0 ? { view: camera.view, width, height } : { camera: JSON.stringify(camera.file(width, height)) });
}

function wanted() {
    if (look.scene === null)
        return null;
    const [width, height] = pictureSize(), output = chosen("output"), color = output === "color";
    const query = (w, h) => {
        const q = cameraQuery(w, h);
        q.set("preset", byId("preset").value);
        q.set("output", output);
        q.set("renderer", color ? byId("renderer").value : "trace");
        q.set("format", color ? byId("transfer").value : "float");
        return q;
    };
    const samples = color && camera.model !== "equirectangular" && byId("live").hidden ? Number(byId("samples").value) : 1;
    return { query, output, width, height, samples, small: byId("moving").value === "auto" };
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
    if (compareMode() === "difference" && look.photo !== null && look.values === null) {
        seen = new Uint8ClampedArray(pixels.length);
        look.psnr = difference(pixels, photoPixels(about.width, about.height), seen);
    }
    canvas.getContext("2d").putImageData(new ImageData(seen, about.width, about.height), 0, 0);
    look.about = about, look.done = done;
    byId("message").hidden = true;
    byId("legend").hidden = look.range === null;
    if (look.range !== null)
        [byId("low").textContent, byId("high").textContent] = look.range.map(v => Number(v.toPrecision(3)));
    requestAnimationFrame(() => describe(about, done));
}

function describe(about, done) {
    const parts = [`${about.width} × ${about.height}`];
    if (pictures.perSecond() >= 1 && performance.now() - pictures.movedAt < 1000)
        parts.push(`${pictures.perSecond().toFixed(0)} pictures/s`);
    const ms = [about.total_ms, about.prepare_ms, about.trace_ms, about.encode_ms + about.transfer_ms, about.draw_ms].map(t => t.toFixed(0));
    parts.push(`${ms[0]} ms (make ${ms[1]}, trace ${ms[2]}, send ${ms[3]}, draw ${ms[4]})`);
    if (done.samples > 1)
        parts.push(`${done.samples} rays/pixel`);
    if (look.psnr !== null)
        parts.push(`${look.psnr.toFixed(2)} dB`);
    if (look.pointed !== undefined)
        parts.push(look.pointed);
    byId("numbers").textContent = parts.join(" · ");
}

function fail(error) {
    byId("message").textContent = error.message;
    byId("message").hidden = false;
}

const pictures = new Pictures(wanted, show, fail);

function changed(moving = false) {
    layout();
    const left = look.view >= 0 && chosen("compare") !== "off" && compareMode() === "off";
    byId("compare-note").textContent = left ? "The camera has left the photo: R goes back." : "";
    byId("model").value = camera.view >= 0 ? "photo" : camera.model;
    byId("fov-row").hidden = camera.view >= 0 || camera.model === "equirectangular";
    byId("fov").max = camera.model === "fisheye" ? 360 : 150;
    byId("fov").value = camera.fov;
    byId("fov-shown").textContent = `${Math.round(camera.fov)}°`;
    pictures.change(moving);
}

// ---- photos --------------------------------------------------------------------------------------------------------------------

function photoPixels(width, height) {
    const canvas = new OffscreenCanvas(width, height), context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(look.photo, 0, 0, width, height);
    return context.getImageData(0, 0, width, height).data;
}

async function fetchPhoto(view) {
    const response = await fetch(`photo?view=${view}&format=raw`);
    if (!response.ok)
        throw new Error((await response.text()).trim());
    const about = JSON.parse(response.headers.get("X-Picture")), bytes = await response.arrayBuffer();
    if (view !== look.view)
        return;
    const canvas = byId("photo");
    canvas.width = about.width, canvas.height = about.height;
    canvas.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(bytes), about.width, about.height), 0, 0);
    look.photo = canvas;
}

// The lens of a camera file that comes nearest to one of a data set.
const lensOf = name => name === "EQUIRECTANGULAR" ? "equirectangular" : name.includes("FISHEYE") ? "fisheye" : "pinhole";

function goTo(index) {
    const view = look.scene.views[index];
    const other = look.view !== index;
    look.view = index;
    camera.place(view.camera, look.middle);
    camera.view = index;
    camera.model = lensOf(view.lens);
    camera.fov = view.fov_x_deg;
    byId("view").value = index;
    if (other) {
        look.photo = null;
        fillSizes();
        fetchPhoto(index).then(() => changed(), fail);
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
    byId("photos-part").hidden = scene.views.length === 0;
}

// ---- the scene, first and again ----------------------------------------------------------------------------------------------------

function firstLook(scene) {
    const poses = scene.views.map(v => ({ eye: v.camera.origin, forward: unit(sub(v.camera.target, v.camera.origin)) }));
    look.middle = meetingPoint(poses, scene.center);
    const up = scene.views.reduce((s, v) => add(s, v.camera.up), [0, 0, 0]);
    camera.level = length(up) > 1e-3 ? unit(up) : [0, -1, 0];
    if (scene.views.length > 0)
        return goTo(Math.max(0, scene.views.findIndex(v => v.test)));
    fillSizes();
    camera.place({ origin: sub(scene.center, mul([0, 0, 1], 2 * Math.max(scene.size, 1e-3))), target: scene.center, up: camera.level }, scene.center);
    changed();
}

async function statusChanged(status) {
    if (status === null)
        return fail(new Error("gbtrace view has ended; start it again to go on."));
    if (status.version === 0)
        return fail(new Error(status.note));
    const scene = await (await fetch("scene")).json(), first = look.scene === null;
    look.scene = scene;
    byId("title").textContent = scene.input.replace(/\/+$/, "").split("/").pop() || scene.input;
    document.title = `${byId("title").textContent} – gbtrace`;
    byId("facts").textContent = scene.plain ? `${scene.gaussians.toLocaleString("en")} Gaussians` :
        `${scene.anchors.toLocaleString("en")} anchors · step ${status.iterations}${status.note ? " · " + status.note : ""}`;
    byId("facts").title = byId("facts").textContent;
    byId("part-name").textContent = scene.plain ? "Gaussians" : "anchors";
    fillViews(scene);
    if (first) {
        byId("renderer").value = scene.renderer;
        firstLook(scene);
    } else {
        byId("view").value = look.view;
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
    if (at === null)
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

function pointAt(event) {
    const at = pixelAt(event), v = look.values;
    look.pointed = undefined;
    if (at !== null && v !== null) {
        const i = v.channels * (Math.floor(at.y * v.height) * v.width + Math.floor(at.x * v.width));
        const some = Array.from(v.values.slice(i, i + v.channels), x => Number(x.toPrecision(4)));
        look.pointed = `${v.output === "anchor" ? byId("part-name").textContent.replace(/s$/, "") : v.output} ${some.join(" ")}`;
    }
    if (look.about !== null)
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
listen(byId("stage"), {
    orbit: (x, y) => { camera.orbit(-2 * Math.PI * x, -Math.PI * y, camera.pivot); moved(); },
    around: (x, y) => { camera.orbit(camera.fov * Math.PI / 180 * x, camera.fov * Math.PI / 180 * y, camera.eye); moved(); },
    shift: (x, y) => { camera.move(-x * camera.viewWidth(), y * camera.viewWidth(), 0); moved(); },
    zoom: factor => { camera.zoom(factor); moved(); },
    fly: (right, up, forward) => { const d = camera.distance(); camera.move(right * d, up * d, forward * d); moved(); },
    pick, point: pointAt,
    photo: step, back: () => look.view >= 0 ? goTo(look.view) : look.scene && firstLook(look.scene),
    split: share => { look.split = share; layout(); },
}, byId("handle"), byId("render-box"));

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
byId("fov").addEventListener("input", () => { camera.fov = Number(byId("fov").value); moved(); });
for (const id of ["compare", "output", "size", "renderer", "preset", "moving", "samples", "transfer"])
    byId(id).addEventListener("change", () => changed());
new ResizeObserver(() => look.scene !== null && changed()).observe(byId("stage"));
if (words.get("transfer") === "jpeg")
    byId("transfer").value = "jpeg";

const rampData = new ImageData(256, 1);
ramp.forEach((c, i) => rampData.data.set([...c, 255], 4 * i));
byId("ramp").getContext("2d").putImageData(rampData, 0, 0);
const training = new Training(byId("training-part"), byId("training-now"), byId("chart"), byId("live"), status => statusChanged(status).catch(fail));
window.gbtrace = { camera, look, pictures, training, changed }; // for the console, and for tests
