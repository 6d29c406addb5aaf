/* SPDX-License-Identifier: Apache-2.0 */
// pictures.js -- one picture after the other: of fewer pixels while the camera moves, then whole, then more rays per pixel, averaged.

const frameMs = 70, wholeMs = 400, stillMs = 180, retryMs = 150, callMs = 5, leastSide = 240;

// fetch() that waits: the server draws for one at a time, and lets an old picture go when a newer one is asked for, maybe by another page.
async function ask(query, signal, isWanted) {
    for (;;) {
        const begin = performance.now(), response = await fetch("render?" + query, { signal });
        if (response.status === 503) {
            await response.arrayBuffer();
            await new Promise(done => setTimeout(done, retryMs));
            if (!isWanted())
                throw new DOMException("", "AbortError");
            continue;
        }
        if (!response.ok)
            throw new Error((await response.text()).trim());
        const about = JSON.parse(response.headers.get("X-Picture"));
        const bytes = await response.arrayBuffer();
        about.total_ms = performance.now() - begin;
        about.transfer_ms = about.total_ms - about.prepare_ms - about.trace_ms - about.encode_ms;
        return { about, bytes, type: response.headers.get("Content-Type") };
    }
}

export class Pictures {
    // wanted(): { query(width, height) -> URLSearchParams, output, width, height, samples, small: while it moves, fewer pixels may come,
    // bounded: when it stands, one of fewer pixels comes before a whole one that takes long, shot: kept for show() } or null;
    // show(picture, done): draws it.
    constructor(wanted, show, fail) {
        Object.assign(this, { wanted, show, fail });
        this.generation = 0;  // counts what would make another picture
        this.shown = null;    // { generation, output, shot, scale, still, samples }
        this.movedAt = -1e9;
        this.cost = { fixed: 0, pixel: 0 }; // ms, and ms per pixel; 0: nothing is known yet
        this.recent = [];     // times of the last pictures
        this.wake = () => {};
        this.asked = new AbortController(); // of the picture that is waited for, since askedAt
        this.askedAt = 0;
        this.askedStill = false;
        this.run();
    }

    // Something changed; `moving`: and will again soon, so that a small picture now is better than a large one later.
    change(moving = false) {
        this.generation++;
        this.movedAt = moving ? performance.now() : -1e9;
        if (this.askedStill && performance.now() - this.askedAt > wholeMs)
            this.asked.abort(); // a long one that nobody wants any more; small ones come as fast as they can
        this.wake();
    }

    // How much smaller each side is so that a picture takes so long. When what pixels do not cost takes most of it, fewer help no more.
    scaleFor(want, ms) {
        if (this.cost.pixel === 0)
            return 0.25;
        const left = Math.max(ms - this.cost.fixed, 0.3 * this.cost.fixed, 10);
        const scale = Math.sqrt(left / (this.cost.pixel * want.width * want.height));
        return Math.min(1, Math.max(leastSide / Math.max(want.width, want.height), Math.floor(16 * scale) / 16));
    }

    // The next picture to ask for after `last`; null: nothing is missing now.
    next(last) {
        const want = this.wanted();
        if (want === null)
            return null;
        const fresh = last === null || last.generation !== this.generation;
        const moving = performance.now() - this.movedAt < stillMs, begun = !fresh && last.still;
        const still = !(want.small && (moving || this.cost.pixel === 0));
        let scale = 1;
        if (!still)
            scale = this.scaleFor(want, frameMs);
        else if (want.bounded && !begun)
            scale = this.scaleFor(want, wholeMs);
        const sample = begun && last.scale === scale ? last.samples : 0; // a mean is over pictures of one size
        if (!fresh && (moving || last.failed || sample >= want.samples))
            return null;
        const width = Math.max(1, Math.round(want.width * scale)), height = Math.max(1, Math.round(want.height * scale));
        const query = want.query(width, height);
        query.set("sample", sample);
        this.asked = new AbortController();
        this.askedAt = performance.now();
        this.askedStill = still;
        const generation = this.generation, answer = ask(query, this.asked.signal, () => generation === this.generation);
        answer.catch(() => {}); // run() tells, when it comes to it
        return { generation, output: want.output, shot: want.shot, scale, still, samples: sample + 1, answer };
    }

    async run() {
        for (let asked = this.next(null); ;) {
            if (asked === null) {
                await new Promise(wake => {
                    this.wake = wake;
                    setTimeout(wake, stillMs / 2); // the end of a movement is no event
                });
                asked = this.next(this.shown);
                continue;
            }
            try {
                const picture = await asked.answer, done = asked;
                this.shown = done;
                this.learn(picture.about);
                asked = this.next(done); // the server works while this is drawn
                const begin = performance.now();
                await this.show(picture, done);
                picture.about.draw_ms = performance.now() - begin;
            } catch (error) {
                this.shown = { ...(asked ?? this.shown), failed: true }; // until something changes
                if (error.name !== "AbortError")
                    this.fail(error);
                asked = this.next(this.shown);
            }
        }
    }

    learn(about) {
        const follow = (old, now) => old === 0 ? now : 0.7 * old + 0.3 * now;
        const call = Math.min(callMs, Math.max(0, about.transfer_ms)), bytes = Math.max(0, about.transfer_ms - callMs);
        if (about.prepare_ms > 0.5)
            this.cost.fixed = follow(this.cost.fixed, about.prepare_ms + call);
        this.cost.pixel = follow(this.cost.pixel, (about.trace_ms + about.encode_ms + bytes) / (about.width * about.height));
        const now = performance.now();
        this.recent = this.recent.filter(t => now - t < 1000).concat(now);
    }

    perSecond() {
        const r = this.recent;
        return r.length > 1 ? (r.length - 1) * 1000 / (r[r.length - 1] - r[0]) : 0;
    }
}
