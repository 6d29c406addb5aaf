/* SPDX-License-Identifier: Apache-2.0 */
// training.js -- how the run goes on: polls /status, reads what log.csv has new, draws PSNR by step.

const pollMs = 1000, liveSeconds = 15;

export class Training {
    // changed(status): the model is another one, or there is one at last, or there is something else to say about it.
    constructor(part, now, chart, live, changed) {
        Object.assign(this, { part, now, chart, live, changed });
        this.forget();
        this.version = -1;
        this.poll();
    }

    forget() {
        this.bytes = 0;
        this.rest = "";
        this.columns = null;
        this.rows = [];
    }

    async poll() {
        try {
            const response = await fetch("status");
            if (response.status === 403) { // another server, which this page's address does not open
                if (!this.gone)
                    this.changed({ version: 0, note: (await response.text()).trim() });
                this.gone = true;
                return void setTimeout(() => this.poll(), pollMs);
            }
            const status = await response.json();
            const isAnother = this.gone || status.started !== this.started;
            if (isAnother)
                this.forget(); // a server that was started again may show another run
            this.live.hidden = !(status.log_age >= 0 && status.log_age < liveSeconds);
            await this.follow(status).catch(() => this.part.hidden = true); // a log of another program
            if (status.version !== this.version || status.note !== this.note || isAnother) {
                this.version = status.version, this.note = status.note, this.started = status.started;
                this.changed(status);
            }
            this.gone = false;
        } catch {
            if (!this.gone)
                this.changed(null); // the server has ended
            this.gone = true;
        }
        setTimeout(() => this.poll(), pollMs);
    }

    async follow(status) {
        if (status.log_bytes !== this.bytes)
            await this.readLog();
        this.describe(status);
    }

    async readLog() {
        const response = await fetch("log?from=" + this.bytes);
        if (!response.ok)
            return;
        const bytes = await response.arrayBuffer();
        if (JSON.parse(response.headers.get("X-Picture")).from === 0)
            this.forget();
        this.bytes += bytes.byteLength;
        const lines = (this.rest + new TextDecoder().decode(bytes)).split("\n");
        this.rest = lines.pop();
        for (const line of lines) {
            const words = line.split(",");
            if (this.columns === null)
                this.columns = words;
            else
                this.rows.push(Object.fromEntries(this.columns.map((name, i) => [name, words[i] === "" ? NaN : Number(words[i])])));
        }
        this.draw();
    }

    describe(status) {
        const row = this.rows.findLast(r => r.train_psnr > 0); // a held-out score right after a row has a row without means
        this.part.hidden = row === undefined;
        if (row === undefined)
            return;
        const counts = `${Math.round(100 * row.progress)} % · ${row.train_psnr.toFixed(1)} dB · ${row.anchors.toLocaleString("en")} anchors`;
        const older = status.iterations > 0 && status.iterations < row.step;
        this.now.textContent = `step ${row.step} · ${counts}${older ? ` (shown: step ${status.iterations})` : ""}`;
    }

    draw() {
        const rows = this.rows.filter(r => r.train_psnr > 0), scored = this.rows.filter(r => r.test_psnr > 0);
        const left = 26, right = 278, top = 6, bottom = 94;
        this.chart.replaceChildren();
        if (rows.length === 0)
            return;
        const values = rows.map(r => r.train_psnr).concat(scored.map(r => r.test_psnr));
        const least = values.reduce((a, b) => Math.min(a, b)), most = values.reduce((a, b) => Math.max(a, b));
        const low = Math.floor(least), high = Math.max(low + 1, Math.ceil(most)), last = this.rows[this.rows.length - 1].step;
        const x = step => left + (right - left) * step / last, y = psnr => bottom - (bottom - top) * (psnr - low) / (high - low);
        const put = (kind, attributes, text) => {
            const e = document.createElementNS("http://www.w3.org/2000/svg", kind);
            for (const [name, value] of Object.entries(attributes))
                e.setAttribute(name, value);
            if (text !== undefined)
                e.textContent = text;
            this.chart.append(e);
        };
        for (const psnr of [low, high]) {
            put("line", { class: "axis", x1: left, x2: right, y1: y(psnr), y2: y(psnr) });
            put("text", { x: left - 4, y: y(psnr) + 3, "text-anchor": "end" }, psnr);
        }
        put("text", { x: left, y: 107 }, "dB, training photos by step");
        put("text", { x: right, y: 107, "text-anchor": "end" }, last);
        const every = Math.ceil(rows.length / 120); // rows of few photos each: means are easier to look at
        const points = [];
        for (let i = 0; i < rows.length; i += every) {
            const some = rows.slice(i, i + every);
            points.push(`${x(some[some.length - 1].step).toFixed(1)},${y(some.reduce((s, r) => s + r.train_psnr, 0) / some.length).toFixed(1)}`);
        }
        put("polyline", { class: "train", points: points.join(" ") });
        if (rows.length === 1) // a line of one point shows nothing
            put("circle", { class: "train", cx: x(rows[0].step), cy: y(rows[0].train_psnr), r: 2 });
        for (const r of scored)
            put("circle", { class: "test", cx: x(r.step), cy: y(r.test_psnr), r: 3 });
    }
}
