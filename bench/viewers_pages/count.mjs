/* SPDX-License-Identifier: Apache-2.0 */
// How many Gaussians an exported file has, and of which degree their colours are, by readers that are not ours: splat-transform, glTF-Transform.
import {execFileSync} from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import {fileURLToPath} from "node:url";

import {NodeIO} from "@gltf-transform/core";

const here = path.dirname(fileURLToPath(import.meta.url));
const degrees = {0: 0, 9: 1, 24: 2, 45: 3};

const splatTransform = path.join(here, "node_modules/@playcanvas/splat-transform/bin/cli.mjs");

// A file in another format, by splat-transform.
export function convert(from, to) {
    execFileSync(process.execPath, [splatTransform, "-w", from, to], {stdio: "ignore"});
}

// What splat-transform says about a file, in its words.
export function describe(file) {
    return execFileSync(process.execPath, [splatTransform, "-w", file, "null", "--info"], {encoding: "utf8", stdio: ["ignore", "pipe", "ignore"]});
}

// The columns of a file as splat-transform reads them: it writes them as a .ply, whose header says their names.
export function columns(file) {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), "gbt_count_"));
    const ply = path.join(folder, "read.ply");
    convert(file, ply);
    const bytes = fs.readFileSync(ply);
    fs.rmSync(folder, {recursive: true});
    const end = bytes.indexOf("end_header\n") + 11;
    const header = bytes.subarray(0, end).toString("latin1").split("\n");
    const names = header.filter((line) => line.startsWith("property float ")).map((line) => line.slice(15));
    const rows = Number(header.find((line) => line.startsWith("element vertex ")).slice(15));
    const values = new Float32Array(bytes.buffer.slice(bytes.byteOffset + end, bytes.byteOffset + end + 4 * rows * names.length));
    const column = (name) => Float32Array.from({length: rows}, (_, i) => values[i * names.length + names.indexOf(name)]);
    return {rows, names, column};
}

// The attributes of a .glb as glTF-Transform reads them.
export async function attributes(file) {
    const document = await new NodeIO().read(file);
    const primitive = document.getRoot().listMeshes()[0].listPrimitives()[0];
    return Object.fromEntries(primitive.listSemantics().map((name) => [name, primitive.getAttribute(name)]));
}

export async function count(file) {
    if (file.endsWith(".glb")) {
        const found = await attributes(file);
        const harmonics = Object.keys(found).filter((name) => name.includes("SH_DEGREE_")).length;
        return {count: found.POSITION.getCount(), degree: Math.sqrt(harmonics) - 1};
    }
    const read = columns(file);
    return {count: read.rows, degree: degrees[read.names.filter((name) => name.startsWith("f_rest_")).length]};
}
