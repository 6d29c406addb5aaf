/* SPDX-License-Identifier: Apache-2.0 */
// paint.js -- numbers to colours: outputs beside colour, and the difference of two pictures.

// Dark blue, teal, green, yellow, near white: rising in lightness, so that order shows in grey too.
const stops = [[18, 18, 62], [38, 72, 140], [28, 128, 140], [92, 178, 98], [222, 206, 78], [255, 248, 226]];
export const ramp = Array.from({ length: 256 }, (_, i) => {
    const at = i / 255 * (stops.length - 1), k = Math.min(Math.floor(at), stops.length - 2);
    return stops[k].map((c, j) => Math.round(c + (stops[k + 1][j] - c) * (at - k)));
});

// [low, high] that holds all but 2 % of the values above 0 at either end.
export function rangeOf(values) {
    const step = Math.max(1, Math.floor(values.length / 20000)), some = [];
    for (let i = 0; i < values.length; i += step)
        if (values[i] > 0)
            some.push(values[i]);
    if (some.length === 0)
        return [0, 1];
    some.sort((a, b) => a - b);
    const low = some[Math.floor(0.02 * (some.length - 1))], high = some[Math.ceil(0.98 * (some.length - 1))];
    return [low, high > low ? high : low + 1e-6];
}

function paintRamp(values, pixels, [low, high], zeroIsNothing) {
    for (let i = 0, o = 0; i < values.length; i++, o += 4) {
        const nothing = zeroIsNothing && !(values[i] > 0);
        const c = ramp[Math.max(0, Math.min(255, Math.round(255 * (values[i] - low) / (high - low))))];
        pixels[o] = nothing ? 0 : c[0], pixels[o + 1] = nothing ? 0 : c[1], pixels[o + 2] = nothing ? 0 : c[2], pixels[o + 3] = 255;
    }
}

function paintNormals(values, pixels) {
    for (let i = 0, o = 0; o < pixels.length; i += 3, o += 4) {
        for (let k = 0; k < 3; k++)
            pixels[o + k] = 127.5 + 127.5 * values[i + k];
        pixels[o + 3] = 255;
    }
}

function paintNames(values, pixels) {
    for (let i = 0, o = 0; i < values.length; i++, o += 4) {
        let h = Math.imul(values[i] + 1, 0x9e3779b1);
        h = Math.imul(h ^ h >>> 15, 0x85ebca6b);
        const shown = values[i] >= 0;
        for (let k = 0; k < 3; k++)
            pixels[o + k] = shown ? 40 + (h >>> 8 * k & 255) * 0.82 : 0;
        pixels[o + 3] = 255;
    }
}

// Values of an output to RGBA; the range that the ramp stands for, or null.
export function paintOutput(output, values, pixels, range) {
    if (output === "normal")
        return paintNormals(values, pixels), null;
    if (output === "anchor")
        return paintNames(values, pixels), null;
    paintRamp(values, pixels, range, output === "depth");
    return range;
}

// Which pixels of a photo count, from its alpha, which is opaque then.
export function takeMarks(pixels) {
    const marks = new Uint8Array(pixels.length / 4);
    for (let i = 0; i < marks.length; i++)
        marks[i] = pixels[4 * i + 3], pixels[4 * i + 3] = 255;
    return marks;
}

// |a - b| four times as bright, and the PSNR of the two, 8 bit, without alpha, of the pixels that count (marks; null: all). null: none does.
export function difference(a, b, marks, out) {
    let sum = 0, count = 0;
    for (let i = 0; i < a.length; i += 4) {
        const counts = marks === null || marks[i / 4] > 0;
        for (let k = 0; k < 3; k++) {
            const d = counts ? Math.abs(a[i + k] - b[i + k]) : 0;
            sum += d * d;
            out[i + k] = 4 * d;
        }
        out[i + 3] = 255;
        count += counts;
    }
    const mse = sum / (3 * count) / (255 * 255);
    return count === 0 ? null : mse > 0 ? Math.min(100, -10 * Math.log10(mse)) : 100;
}
