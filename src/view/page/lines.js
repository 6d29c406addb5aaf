/* SPDX-License-Identifier: Apache-2.0 */
// lines.js -- lines over the picture: the floor's grid, the axes, the photos' cameras. By the camera file of what was drawn: at a photo's own
// camera without its centre and distortion.
import { add, cross, dot, length, mul, sub, unit } from "./camera.js";

// Points of the scene to the picture of a camera file, in pixels: { z: how far in front, at: [x, y] }, or null where it is not seen.
export function lensOf(shot) {
    const forward = unit(sub(shot.target, shot.origin)), right = unit(cross(forward, shot.up)), down = cross(forward, right);
    const { width, height } = shot, middle = [width / 2, height / 2], half = shot.fov_x_deg * Math.PI / 360;
    const turn = p => {
        const d = sub(p, shot.origin);
        return [dot(d, right), dot(d, down), dot(d, forward)];
    };
    const scaled = (q, s) => [middle[0] + s * q[0], middle[1] + s * q[1]];
    const flat = {
        pinhole: q => scaled(q, middle[0] / Math.tan(half) / q[2]),
        orthographic: q => scaled(q, width / shot.view_width),
    }[shot.model];
    const round = {
        fisheye: q => {
            const across = Math.hypot(q[0], q[1]), angle = Math.atan2(across, q[2]);
            return angle < 3 ? scaled(q, middle[0] / half * angle / Math.max(across, 1e-12)) : null;
        },
        equirectangular: q => [width * (0.5 + Math.atan2(q[0], q[2]) / (2 * Math.PI)), height * (0.5 + Math.asin(q[1] / (length(q) || 1)) / Math.PI)],
    }[shot.model];
    return { turn, flat, round };
}

// The picture's curve of a straight line: [[x, y], ...], none where it is behind. Round lenses bend it.
function curve(lens, from, to, near) {
    let a = lens.turn(from), b = lens.turn(to);
    if (lens.flat !== undefined) {
        if (a[2] < near && b[2] < near)
            return [];
        const cut = (p, q) => p[2] >= near ? p : add(p, mul(sub(q, p), (near - p[2]) / (q[2] - p[2])));
        return [lens.flat(cut(a, b)), lens.flat(cut(b, a))];
    }
    return Array.from({ length: 17 }, (_, i) => lens.round(add(a, mul(sub(b, a), i / 16))));
}

// 1, 2 or 5 times a power of ten: the one nearest below.
export function roundBelow(x) {
    const ten = 10 ** Math.floor(Math.log10(x));
    return [5, 2, 1].find(n => n * ten <= x * 1.0001) * ten;
}

// Beside the middle, on the floor: lines every `step`, and the data set's axes.
function gridLines({ subject, up, floor }) {
    const step = roundBelow(subject.radius / 2), n = 10, foot = add(subject.middle, mul(up, floor - dot(subject.middle, up)));
    const along = unit(cross(up, Math.abs(up[0]) < 0.8 ? [1, 0, 0] : [0, 1, 0])), across = cross(up, along);
    const at = (i, j) => add(foot, add(mul(along, i * step), mul(across, j * step)));
    const lines = [];
    for (let i = -n; i <= n; i++)
        for (let j = -n; j < n; j++) // cell by cell, as a line may be seen in part
            lines.push([at(i, j), at(i, j + 1)], [at(j, i), at(j + 1, i)]);
    const axis = k => [0, 1, 2].map(i => i === k ? 2 * step : 0);
    return { lines, axes: [0, 1, 2].map(k => [foot, add(foot, axis(k))]) };
}

// A pyramid from the eye to a small picture, with a roof that says where up is.
function pyramid(view, size) {
    const { origin, target, up } = view.camera, forward = unit(sub(target, origin)), right = unit(cross(forward, up)), over = cross(right, forward);
    const w = Math.tan(Math.min(view.fov_x_deg, 110) * Math.PI / 360), h = w * view.height / view.width, far = size / Math.max(w, h, 0.5);
    const corner = (x, y) => add(origin, mul(add(forward, add(mul(right, x * w), mul(over, y * h))), far));
    const c = [corner(-1, 1), corner(1, 1), corner(1, -1), corner(-1, -1)], roof = corner(0, 1.5);
    return [...c.map((p, i) => [p, c[(i + 1) % 4]]), ...c.map(p => [origin, p]), [c[0], roof], [roof, c[1]]];
}

export class Lines {
    constructor(canvas) {
        this.canvas = canvas;
        this.eyes = []; // of the photos' cameras that are seen: { index, x, y } in CSS pixels
    }

    // `show`: { grid, cameras }; `place`: { subject, up, floor, views, view }. The canvas covers the picture.
    draw(shot, show, place) {
        const { canvas } = this, scale = window.devicePixelRatio, box = canvas.getBoundingClientRect(), context = canvas.getContext("2d");
        canvas.width = Math.round(box.width * scale), canvas.height = Math.round(box.height * scale);
        this.eyes = [];
        if (shot === null || !(show.grid || show.cameras))
            return;
        const lens = lensOf(shot), near = place.subject.radius * 1e-3, pixel = canvas.width / shot.width;
        const jump = lens.flat !== undefined ? Infinity : shot.width / 2; // over the seam of a panorama
        const stroke = (lines, color, width, edge = 0.45) => {
            context.beginPath();
            for (const [from, to] of lines) {
                let last = null;
                for (const p of curve(lens, from, to, near)) {
                    if (last !== null && p !== null && Math.abs(p[0] - last[0]) < jump) {
                        context.moveTo(last[0] * pixel, last[1] * pixel);
                        context.lineTo(p[0] * pixel, p[1] * pixel);
                    }
                    last = p;
                }
            }
            for (const [style, wide] of [[`rgba(0, 0, 0, ${edge})`, width + 2], [color, width]]) {
                context.strokeStyle = style, context.lineWidth = wide * scale;
                context.stroke();
            }
        };
        if (show.grid)
            this.drawGrid(lens, stroke, near, pixel, place, context, scale);
        if (show.cameras)
            this.drawCameras(lens, stroke, near, pixel / scale, place, shot);
    }

    drawGrid(lens, stroke, near, pixel, place, context, scale) {
        const { lines, axes } = gridLines(place);
        stroke(lines, "rgba(255, 255, 255, .6)", 0.8, 0.2);
        axes.forEach((axis, k) => {
            const color = ["#ff5a4f", "#5bd75b", "#5aa2ff"][k], end = curve(lens, axis[1], axis[1], near)[0];
            stroke([axis], color, 2.5);
            if (!end)
                return;
            context.font = `600 ${14 * scale}px system-ui, sans-serif`;
            context.lineWidth = 3 * scale, context.strokeStyle = "rgba(0, 0, 0, .6)", context.fillStyle = color;
            context.strokeText("xyz"[k], end[0] * pixel + 5 * scale, end[1] * pixel);
            context.fillText("xyz"[k], end[0] * pixel + 5 * scale, end[1] * pixel);
        });
    }

    // Not those at the eye: they would frame the picture.
    drawCameras(lens, stroke, near, pixel, place, shot) {
        const size = 0.1 * place.subject.radius, sorted = { true: [], false: [], last: [] };
        place.views.forEach((view, index) => {
            if (length(sub(view.camera.origin, shot.origin)) < 3 * size)
                return;
            sorted[index === place.view ? "last" : view.test].push(...pyramid(view, size));
            const p = curve(lens, view.camera.origin, view.camera.origin, near)[0];
            if (p && p[0] >= 0 && p[0] < shot.width && p[1] >= 0 && p[1] < shot.height)
                this.eyes.push({ index, x: p[0] * pixel, y: p[1] * pixel });
        });
        stroke(sorted[false], "#7db8ff", 1);
        stroke(sorted[true], "#ffb066", 1.4);
        stroke(sorted.last, "#fff", 2.2);
    }

    // The photo whose camera is seen within a finger's width of a point of the page; -1: none.
    cameraAt(x, y) {
        const box = this.canvas.getBoundingClientRect();
        let best = -1, least = 16;
        for (const eye of this.eyes) {
            const far = Math.hypot(eye.x - (x - box.left), eye.y - (y - box.top));
            if (far < least)
                best = eye.index, least = far;
        }
        return best;
    }
}
