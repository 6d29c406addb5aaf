// pictures.js -- one picture after the other: small while the camera moves, then whole, then more rays per pixel, averaged.

const frameMs = 50, stillMs = 180, retryMs = 150;

// fetch() that waits: the server draws for one at a time, and lets an old picture go when a newer one is asked for.
async function ask(query) {
    const begin = performance.now();
    for (;;) {
        const response = await fetch("render?" + query);
        if (response.status === 503) {
            await response.arrayBuffer();
            await new Promise(done => setTimeout(done, retryMs));
            if (performance.now() - begin > 5000)
                throw new Error("busy");
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
    // wanted(): { query(width, height) -> URLSearchParams, output, width, height, samples, small } or null; show(picture): draws it.
    constructor(wanted, show, fail) {
        Object.assign(this, { wanted, show, fail });
        this.generation = 0;  // counts what would make another picture
        this.shown = null;    // { generation, output, scale, samples }
        this.movedAt = -1e9;
        this.cost = { fixed: 0, pixel: 0 }; // ms, and ms per pixel
        this.recent = [];     // times of the last pictures
        this.wake = () => {};
        this.run();
    }

    // Something changed; `moving`: and will again soon, so that a small picture now is better than a large one later.
    change(moving = false) {
        this.generation++;
        this.movedAt = moving ? performance.now() : -1e9;
        this.wake();
    }

    scaleFor(want) {
        const left = frameMs - this.cost.fixed;
        if (!want.small || this.cost.pixel === 0)
            return 1;
        const scale = Math.sqrt(Math.max(left, 5) / (this.cost.pixel * want.width * want.height));
        return Math.min(1, Math.max(0.25, Math.floor(8 * scale) / 8));
    }

    // The next picture to ask for after `last`; null: nothing is missing now.
    next(last) {
        const want = this.wanted();
        if (want === null)
            return null;
        const fresh = last === null || last.generation !== this.generation;
        const moving = performance.now() - this.movedAt < stillMs;
        const scale = moving ? this.scaleFor(want) : 1;
        const sample = fresh || last.scale < 1 ? 0 : last.samples;
        if (!fresh && (moving || last.failed || sample >= want.samples))
            return null;
        const width = Math.max(1, Math.round(want.width * scale)), height = Math.max(1, Math.round(want.height * scale));
        const query = want.query(width, height);
        query.set("sample", sample);
        return { generation: this.generation, output: want.output, scale, samples: sample + 1, answer: ask(query) };
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
                asked = this.next(done); // the server works while this is drawn
                this.learn(picture.about);
                const begin = performance.now();
                await this.show(picture, done);
                picture.about.draw_ms = performance.now() - begin;
            } catch (error) {
                this.shown = { ...asked, failed: true }; // until something changes
                this.fail(error);
                asked = this.next(this.shown);
            }
        }
    }

    learn(about) {
        const follow = (old, now) => old === 0 ? now : 0.7 * old + 0.3 * now;
        if (about.prepare_ms > 0.5)
            this.cost.fixed = follow(this.cost.fixed, about.prepare_ms);
        this.cost.pixel = follow(this.cost.pixel, (about.trace_ms + about.encode_ms + Math.max(0, about.transfer_ms)) / (about.width * about.height));
        const now = performance.now();
        this.recent = this.recent.filter(t => now - t < 1000).concat(now);
    }

    perSecond() {
        const r = this.recent;
        return r.length > 1 ? (r.length - 1) * 1000 / (r[r.length - 1] - r[0]) : 0;
    }
}
