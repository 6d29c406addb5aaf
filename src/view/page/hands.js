/* SPDX-License-Identifier: Apache-2.0 */
// hands.js -- pointers, wheel and keys to movements; what they do to the camera is not known here.

const keysOf = {
    KeyW: [0, 0, 1], ArrowUp: [0, 0, 1], KeyS: [0, 0, -1], ArrowDown: [0, 0, -1], KeyA: [-1, 0, 0], ArrowLeft: [-1, 0, 0],
    KeyD: [1, 0, 0], ArrowRight: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0],
};
const clickPixels = 5;

// A control that was reached by the keyboard keeps the keys that it understands itself; the others are the stage's.
const isItsOwn = event => event.target.closest("select, dialog") !== null ||
    event.target.matches("input[type=range], input[type=radio]") && event.code.startsWith("Arrow");

// After a click, or a choice by the pointer, the keys are the stage's again.
function giveBackFocus(controls, stage) {
    let byPointer = false;
    const back = () => setTimeout(() => stage.focus({ preventScroll: true })); // after a label has given it to its control
    window.addEventListener("pointerdown", () => byPointer = true, true);
    window.addEventListener("keydown", () => byPointer = false, true);
    controls.addEventListener("click", event => byPointer && event.target.closest("select") === null && back());
    controls.addEventListener("change", () => byPointer && back());
}

function listenToPointers(stage, act, handle, picture) {
    const down = new Map(); // pointers by id: last x and y
    let travelled = 0;      // pixels since the first of them, of all
    const size = () => Math.max(1, Math.min(stage.clientWidth, stage.clientHeight));

    stage.addEventListener("pointerdown", event => {
        if (event.target === handle)
            return;
        stage.focus({ preventScroll: true });
        stage.setPointerCapture(event.pointerId);
        travelled = down.size === 0 ? 0 : Infinity; // two fingers are no click
        down.set(event.pointerId, [event.clientX, event.clientY]);
        stage.classList.add("dragging");
    });
    stage.addEventListener("pointermove", event => {
        const last = down.get(event.pointerId);
        if (last === undefined)
            return act.point(event);
        const x = event.clientX - last[0], y = event.clientY - last[1];
        travelled += Math.hypot(x, y);
        if (travelled < clickPixels)
            return;
        if (down.size === 2) {
            const other = [...down].find(([id]) => id !== event.pointerId)[1];
            const before = Math.hypot(last[0] - other[0], last[1] - other[1]), after = Math.hypot(event.clientX - other[0], event.clientY - other[1]);
            act.zoom(Math.max(before, 1) / Math.max(after, 1));
            act.shift(x / 2, y / 2);
        } else if (event.ctrlKey || event.altKey) {
            act.around(x, y);
        } else if (event.shiftKey || event.buttons & 6) {
            act.shift(x, y);
        } else {
            act.orbit(x / size(), y / size());
        }
        down.set(event.pointerId, [event.clientX, event.clientY]);
    });
    const up = event => {
        if (down.delete(event.pointerId) && down.size === 0 && travelled < clickPixels && event.type === "pointerup" && event.button === 0)
            act.click(event);
        stage.classList.toggle("dragging", down.size > 0);
    };
    stage.addEventListener("pointerup", up);
    stage.addEventListener("pointercancel", up);
    stage.addEventListener("contextmenu", event => event.preventDefault());
    stage.addEventListener("wheel", event => {
        event.preventDefault();
        const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1;
        if (event.deltaY !== 0) // not a swipe to the side
            act.zoom(Math.exp(Math.max(-200, Math.min(200, event.deltaY * lines)) * 0.0015));
    }, { passive: false });
    stage.addEventListener("dblclick", event => act.pick(event));

    const splitAt = event => {
        const box = picture.getBoundingClientRect();
        act.split(Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)));
    };
    handle.addEventListener("pointerdown", event => handle.setPointerCapture(event.pointerId));
    handle.addEventListener("pointermove", event => handle.hasPointerCapture(event.pointerId) && splitAt(event));
    handle.addEventListener("keydown", event => {
        const by = { ArrowLeft: -0.02, ArrowDown: -0.02, ArrowRight: 0.02, ArrowUp: 0.02, Home: -1, End: 1 }[event.code];
        if (by === undefined)
            return;
        event.preventDefault();
        event.stopPropagation();
        act.split(Math.min(1, Math.max(0, Number(handle.getAttribute("aria-valuenow")) / 100 + by)));
    });
}

function listenToKeys(act) {
    const held = new Set();
    let fast = false, flying = false, before = 0;
    const fly = now => {
        const seconds = Math.min(0.1, (now - before) / 1000) * (fast ? 4 : 1);
        before = now;
        flying = held.size > 0;
        if (!flying)
            return;
        const way = [0, 0, 0];
        for (const code of held)
            keysOf[code].forEach((v, i) => way[i] += v * seconds);
        requestAnimationFrame(fly); // before, so that what goes wrong in a frame ends no flight
        act.fly(...way);
    };
    window.addEventListener("keydown", event => {
        if (isItsOwn(event) || event.ctrlKey || event.metaKey)
            return;
        // By the letter, else by its place where the layout has other letters; [ and ] want Alt on some.
        const own = act.keys[event.key.toLowerCase()] ?? act.keys[event.code.replace("Key", "").toLowerCase()];
        if (event.altKey && !"[]".includes(event.key))
            return;
        fast = event.shiftKey;
        if (event.code in keysOf) {
            event.preventDefault();
            held.add(event.code);
            if (!flying) {
                flying = true;
                before = performance.now();
                requestAnimationFrame(fly);
            }
        } else if (!event.repeat && own !== undefined) {
            own();
        }
    });
    window.addEventListener("keyup", event => {
        held.delete(event.code);
        if (event.key === "Meta")
            held.clear(); // macOS tells of no other key that is let go of meanwhile
        fast = event.shiftKey;
    });
    window.addEventListener("blur", () => held.clear());
}

// `act`: orbit (x, y: shares of the stage's smaller side), around, shift (x, y: pixels), zoom(factor), fly(right, up, forward: seconds),
// click(event), pick(event), point(event), split(share of the picture's width); keys: functions by the key.
export function listen(stage, act, handle, picture, controls) {
    listenToPointers(stage, act, handle, picture);
    listenToKeys(act);
    giveBackFocus(controls, stage);
}
