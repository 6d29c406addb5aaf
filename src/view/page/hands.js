// hands.js -- pointers, wheel and keys to movements; what they do to the camera is not known here.

const keysOf = {
    KeyW: [0, 0, 1], ArrowUp: [0, 0, 1], KeyS: [0, 0, -1], ArrowDown: [0, 0, -1], KeyA: [-1, 0, 0], ArrowLeft: [-1, 0, 0],
    KeyD: [1, 0, 0], ArrowRight: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0],
};
const typing = target => target.closest("select, input, textarea, button") !== null;

// `act`: orbit, around, shift (x, y: shares of the stage's smaller side), zoom(factor), fly(right, up, forward), pick(event), point(event), photo(by),
// back(), split(share of the picture's width).
export function listen(stage, act, handle, picture) {
    const down = new Map(); // pointers by id: last x and y
    const size = () => Math.max(1, Math.min(stage.clientWidth, stage.clientHeight));

    stage.addEventListener("pointerdown", event => {
        if (event.target === handle)
            return;
        stage.focus({ preventScroll: true });
        stage.setPointerCapture(event.pointerId);
        down.set(event.pointerId, [event.clientX, event.clientY]);
        stage.classList.add("dragging");
    });
    stage.addEventListener("pointermove", event => {
        const last = down.get(event.pointerId);
        if (last === undefined)
            return act.point(event);
        const x = (event.clientX - last[0]) / size(), y = (event.clientY - last[1]) / size();
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
            act.orbit(x, y);
        }
        down.set(event.pointerId, [event.clientX, event.clientY]);
    });
    const up = event => {
        down.delete(event.pointerId);
        stage.classList.toggle("dragging", down.size > 0);
    };
    stage.addEventListener("pointerup", up);
    stage.addEventListener("pointercancel", up);
    stage.addEventListener("contextmenu", event => event.preventDefault());
    stage.addEventListener("wheel", event => {
        event.preventDefault();
        const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1;
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
        const by = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.code];
        if (by === undefined)
            return;
        event.stopPropagation();
        act.split(Math.min(1, Math.max(0, Number(handle.getAttribute("aria-valuenow")) / 100 + by)));
    });

    const held = new Set();
    let fast = false, flying = false, before = 0;
    const fly = now => {
        const seconds = Math.min(0.1, (now - before) / 1000), speed = (fast ? 3 : 0.8) * seconds;
        before = now;
        flying = held.size > 0;
        if (!flying)
            return;
        const way = [0, 0, 0];
        for (const code of held)
            keysOf[code].forEach((v, i) => way[i] += v * speed);
        act.fly(...way);
        requestAnimationFrame(fly);
    };
    window.addEventListener("keydown", event => {
        if (typing(event.target) || event.ctrlKey || event.metaKey || event.altKey)
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
        } else if (event.key === "[" || event.key === "]") {
            act.photo(event.key === "[" ? -1 : 1);
        } else if (event.code === "KeyR") {
            act.back();
        }
    });
    window.addEventListener("keyup", event => {
        held.delete(event.code);
        fast = event.shiftKey;
    });
    window.addEventListener("blur", () => held.clear());
}
