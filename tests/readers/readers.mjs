/* SPDX-License-Identifier: Apache-2.0 */
// Gaussians written by gbtrace export, read by splat-transform, glTF-Transform, plyfile, gsply, usd-core and tinyusdz, the other way packed by splat-transform and sogpy;
// and looked over by Khronos' and OpenUSD's validators: counts and every attribute. Usage: readers.mjs PROGRAM PYTHON READ_COLUMNS; see test_readers.sh.
import {execFileSync} from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";

import validator from "gltf-validator";

import {attributes, columns, convert, describe} from "./count.mjs";

const [program, python, readColumns] = process.argv.slice(2), COUNT = 200;
const folder = fs.mkdtempSync(path.join(os.tmpdir(), "gbt_readers_"));
let failures = 0, state = 1;

function random() { // the same numbers everywhere
    state = (state * 48271) % 2147483647;
    return state / 2147483647;
}

function check(what, worst, limit) {
    console.log(`${worst <= limit ? "ok" : "FAILED"}: ${what}: ${worst.toPrecision(3)} (limit ${limit})`);
    failures += !(worst <= limit);
}

const names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", ...Array.from({length: 45}, (_, i) => `f_rest_${i}`), "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"];
const rows = Array.from({length: COUNT}, () => {
    const quaternion = Array.from({length: 4}, () => 2 * random() - 1), length = Math.hypot(...quaternion);
    return names.map((name) => name.startsWith("rot_") ? quaternion[Number(name[4])] / length : name.startsWith("scale_") ? -4 * random() - 1
        : name === "opacity" ? 8 * random() - 4 : name.startsWith("f_") ? 1.6 * random() - 0.8 : 20 * random() - 10);
});
const value = (i, name) => rows[i][names.indexOf(name)];
const source = path.join(folder, "source.ply");
const data = new Float32Array(rows.flat());
fs.writeFileSync(source, Buffer.concat([Buffer.from(`ply\nformat binary_little_endian 1.0\nelement vertex ${COUNT}\n${names.map((n) => `property float ${n}\n`).join("")}end_header\n`),
    Buffer.from(data.buffer)]));
const file = (ending) => path.join(folder, `out.${ending}`);
execFileSync(program, ["export", source, ...["ply", "splat", "spz", "glb", "compressed.ply", "v4.spz", "sog"].map(file)], {stdio: "ignore"});
execFileSync(program, ["export", source, file("usda"), file("usdz")], {stdio: "ignore"});

// Readers may put Gaussians in another order: partners are those of the nearest place.
function partners(place) {
    return Array.from({length: COUNT}, (_, j) => rows.reduce((best, row, i) => {
        const distance = Math.hypot(...place(j).map((x, k) => x - row[k]));
        return distance < best.distance ? {distance, i} : best;
    }, {distance: Infinity, i: -1}));
}

const alpha = (logit) => 1 / (1 + Math.exp(-logit));
const limits = {ply: {place: 1e-6, scale: 1e-6, rotation: 1e-6, alpha: 1e-6, dc: 1e-6, rest: 1e-6}, splat: {place: 1e-6, scale: 1e-5, rotation: 0.001, alpha: 0.003, dc: 0.008},
    spz: {place: 1e-4, scale: 0.032, rotation: 1e-5, alpha: 0.003, dc: 0.014, rest: 0.07},
    "compressed.ply": {place: 0.015, scale: 0.003, rotation: 5e-6, alpha: 0.003, dc: 0.012, rest: 0.016}, sog: {place: 0.001, scale: 0.016, rotation: 5e-5, alpha: 0.003, dc: 0.007, rest: 0.01}};
Object.assign(limits, {"v4.spz": limits.spz, usda: limits.ply, usdz: limits.ply});

function byPython(reader, path) {
    const read = JSON.parse(execFileSync(python, [readColumns, reader, path], {maxBuffer: 1 << 28}));
    return {rows: read.x.length, names: Object.keys(read), column: (name) => read[name]};
}

// Every attribute of every Gaussian, as one reader has it.
function compare(ending, reader, read, limit = limits[ending]) {
    check(`${ending} by ${reader}: Gaussians missing`, Math.abs(read.rows - COUNT), 0);
    const get = Object.fromEntries(read.names.map((name) => [name, read.column(name)]));
    const pairs = partners((j) => [get.x[j], get.y[j], get.z[j]]);
    const worst = {place: 0, scale: 0, rotation: 0, alpha: 0, dc: 0, rest: 0};
    pairs.forEach(({distance, i}, j) => {
        worst.place = Math.max(worst.place, distance);
        for (let k = 0; k < 3; k++) {
            worst.scale = Math.max(worst.scale, Math.abs(get[`scale_${k}`][j] - value(i, `scale_${k}`)));
            const dc = Math.min(Math.max(value(i, `f_dc_${k}`), ending === "splat" ? -1.7724 : -9), ending === "splat" ? 1.7724 : 9);
            worst.dc = Math.max(worst.dc, Math.abs(get[`f_dc_${k}`][j] - dc));
        }
        const q = [0, 1, 2, 3].map((k) => get[`rot_${k}`][j]), length = Math.hypot(...q);
        worst.rotation = Math.max(worst.rotation, 1 - Math.abs(q.reduce((sum, x, k) => sum + x * value(i, `rot_${k}`), 0)) / length);
        worst.alpha = Math.max(worst.alpha, Math.abs(alpha(get.opacity[j]) - alpha(value(i, "opacity"))));
        for (let k = 0; k < 45 && limit.rest; k++)
            worst.rest = Math.max(worst.rest, Math.abs(get[`f_rest_${k}`][j] - value(i, `f_rest_${k}`)));
    });
    for (const [name, most] of Object.entries(limit))
        check(`${ending} by ${reader}: ${name}`, worst[name], most);
}

for (const ending of ["ply", "splat", "spz", "compressed.ply", "v4.spz", "sog"])
    compare(ending, "splat-transform", columns(file(ending)));
for (const ending of ["spz", "compressed.ply", "v4.spz", "sog"])
    compare(ending, "gsply", byPython("gsply", file(ending)));
for (const ending of ["usda", "usdz"])
    for (const reader of ["usd-core", "tinyusdz"])
        compare(ending, reader, byPython(reader, file(ending)));
for (const ending of ["usda", "usdz"]) {
    const said = byPython("usd-core", file(ending)).column("said");
    said.forEach((line) => console.log(line));
    check(`${ending}: errors of OpenUSD's validators`, said.length, 0);
}

// The other way: what splat-transform packs, we read. Its .spz is of version 4, with 12 bits behind the point.
for (const ending of ["compressed.ply", "spz"]) {
    const packed = path.join(folder, `theirs.${ending}`), unpacked = path.join(folder, "unpacked.ply");
    convert(source, packed);
    execFileSync(program, ["export", packed, unpacked], {stdio: "ignore"});
    compare(ending, "gbtrace, of splat-transform", columns(unpacked), {...limits[ending], place: ending === "spz" ? 2.2e-4 : 0.015});
}

// A .sog by sogpy, one colour for all directions: it wants more Gaussians for a palette. It cuts numbers off where others round.
{
    const plain = path.join(folder, "plain.ply"), packed = path.join(folder, "theirs.sog"), unpacked = path.join(folder, "unpacked.ply");
    const {rest: _, ...kept} = limits.sog;
    execFileSync(program, ["export", source, plain, "--sh-degree", "0"], {stdio: "ignore"});
    execFileSync(path.join(path.dirname(python), "sogpy"), [plain, packed], {stdio: "ignore"});
    execFileSync(program, ["export", packed, unpacked], {stdio: "ignore"});
    compare("sog", "gbtrace, of sogpy", columns(unpacked), {...kept, place: 0.002, scale: 0.02, rotation: 1e-4, alpha: 0.004});
}

// The mark of a model that is drawn as wide as pixels goes from file to file.
const marked = path.join(folder, "marked.ply");
fs.writeFileSync(marked, Buffer.from(fs.readFileSync(source).toString("latin1").replace("1.0\n", "1.0\ncomment SplatRenderMode: mip\n"), "latin1"));
for (const ending of ["ply", "compressed.ply", "spz", "v4.spz", "sog"]) {
    const out = path.join(folder, `marked_out.${ending}`);
    execFileSync(program, ["export", marked, out], {stdio: "ignore"});
    check(`${ending}: the mark is missing`, describe(out).includes("antialiased") ? 0 : 1, 0);
}

// What splat-transform reads of a .ply, plyfile reads too: the same numbers in the same columns.
const byName = byPython("plyfile", file("ply")), plain = columns(file("ply"));
check("ply: columns that plyfile lacks", plain.names.filter((name) => !byName.names.includes(name)).length, 0);
check("ply: plyfile against splat-transform", Math.max(...plain.names.flatMap((name) => Array.from(plain.column(name), (x, i) => Math.abs(x - byName.column(name)[i])))), 0);

// The validator is older than the extension: names that begin with the extension's are new to it, and nothing else may be.
const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file("glb"))));
const isNew = (m) => m.code === "MESH_PRIMITIVE_INVALID_ATTRIBUTE" && m.pointer.includes("/KHR_gaussian_splatting:");
const said = report.issues.messages.filter((m) => m.severity < 2 && !isNew(m));
said.forEach((m) => console.log(`${m.code} ${m.pointer}: ${m.message}`));
check("glb: errors and warnings of the validator", said.length, 0);

// glTF has y up: half a turn about z.
const glb = await attributes(file("glb"));
const at = (name, j) => glb[name].getElement(j, []);
check("glb: Gaussians missing", Math.abs(glb.POSITION.getCount() - COUNT), 0);
const worst = {place: 0, scale: 0, rotation: 0, alpha: 0, dc: 0, rest: 0};
partners((j) => [-at("POSITION", j)[0], -at("POSITION", j)[1], at("POSITION", j)[2]]).forEach(({distance, i}, j) => {
    worst.place = Math.max(worst.place, distance);
    const turned = [-value(i, "rot_1"), -value(i, "rot_2"), value(i, "rot_3"), value(i, "rot_0")]; // up to the half turn's own axes
    const q = at("KHR_gaussian_splatting:ROTATION", j);
    worst.rotation = Math.max(worst.rotation, 1 - Math.abs(q.reduce((sum, x, k) => sum + x * turned[k], 0)));
    worst.alpha = Math.max(worst.alpha, Math.abs(at("KHR_gaussian_splatting:OPACITY", j)[0] - alpha(value(i, "opacity"))));
    for (let k = 0; k < 3; k++) {
        worst.scale = Math.max(worst.scale, Math.abs(Math.log(at("KHR_gaussian_splatting:SCALE", j)[k]) - value(i, `scale_${k}`)));
        worst.dc = Math.max(worst.dc, Math.abs(at("KHR_gaussian_splatting:SH_DEGREE_0_COEF_0", j)[k] - value(i, `f_dc_${k}`)));
        worst.rest = Math.max(worst.rest, Math.abs(at("KHR_gaussian_splatting:SH_DEGREE_1_COEF_0", j)[k] + value(i, `f_rest_${15 * k}`)));
    }
});
for (const [name, most] of Object.entries({place: 1e-6, scale: 1e-6, rotation: 1e-6, alpha: 1e-6, dc: 1e-6, rest: 1e-6}))
    check(`glb: ${name}`, worst[name], most);
fs.rmSync(folder, {recursive: true});
process.exit(failures > 0 ? 1 : 0);
