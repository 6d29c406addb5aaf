/* SPDX-License-Identifier: Apache-2.0 */
// keep.js -- what is shown to a file, texts to the clipboard.

export function savePicture(canvas, name) {
    canvas.toBlob(blob => {
        const link = document.createElement("a");
        link.href = URL.createObjectURL(blob);
        link.download = name;
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    }, "image/png");
}

// The button says that it is done; where the clipboard is closed the text is shown instead.
export async function copyText(button, text) {
    const name = button.dataset.name ??= button.textContent; // not "Copied", of a click before
    try {
        await navigator.clipboard.writeText(text);
        button.textContent = "Copied";
        setTimeout(() => button.textContent = name, 1200);
    } catch {
        prompt("Copy this:", text);
    }
}
