// The images of one scene of a study: two of them under a slider, and a row of small ones of the same region.
//
//   const images = new studyParts.Images(element, scene, page)
(function (parts) {
    'use strict';

    // In a strip the reference has index 0; these are the offsets of the images of a scene's point.
    const SHOWN = { image: 1, error: 2, flip: 3 };
    const CELL = 150;  // pixels of the screen across a small image

    parts.decodeError = (byte, code) => Math.sign(byte - 128) * code.least *
        Math.expm1(Math.abs(byte - 128) / 127 * Math.log1p(code.most / code.least));

    class Images {
        constructor(element, scene, page) {
            this.scene = scene;
            this.page = page;
            this.points = scene.points.filter((p) => p.radiance.src);
            this.left = null;   // a point; null: the reference
            this.right = null;
            const large = parts.make('div', element, { className: 'large' });
            // Limits the size to what a window shows at once.
            large.style.maxWidth = `max(30rem, 75vh * ${scene.width / scene.height})`;
            this.film = parts.make('div', element, { className: 'film' });
            this.film.setAttribute('role', 'group');
            this.film.setAttribute('aria-label', 'images; shift chooses for the right side');
            this.strip = imageStrip(parts.make('div', large), this.entries(), {
                lazy: true, left: 0, right: 0, stops: scene.stops,
                choose: (side, number) => page.choose(this.pointOf(number), side, scene),
                drawn: () => this.paintFilm(),
            });
            this.note = parts.make('p', large, { className: 'hint' });
            this.ready = this.strip.ready;
        }

        entries() {
            const entries = [{ name: 'reference', kind: 'radiance', ...this.scene.reference }];
            for (const point of this.points) {
                const name = parts.label(point);
                entries.push({ name, kind: 'radiance', ...point.radiance });
                entries.push({ name: name + ', signed error', kind: 'coded', listed: false, channel: 0, ...point.maps,
                               lookup: () => this.page.errorColours,
                               value: (byte) => parts.percent(parts.decodeError(byte, this.page.study.code)) });
                entries.push({ name: name + ', FLIP', kind: 'coded', listed: false, channel: 1, ...point.maps,
                               lookup: () => this.page.study.flip, value: (byte) => parts.plain(byte / 255) });
            }
            return entries;
        }

        // Returns the strip's index of what is shown of a point.
        number(point) {
            const i = this.points.indexOf(point);
            if (i < 0) return 0;
            const shown = this.page.shown !== 'image' && point.maps.src ? this.page.shown : 'image';
            return 3 * i + SHOWN[shown];
        }
        pointOf(number) { return number === 0 ? null : this.points[Math.floor((number - 1) / 3)]; }

        choose(point, side) {
            if (point && !this.points.includes(point)) return;  // its image is left out
            this[side] = point;
            this.update();
        }

        update() {
            for (const side of ['left', 'right']) {
                const i = this.points.indexOf(this[side]);
                this.strip[side === 'left' ? 'chooseLeft' : 'chooseRight'].value = i < 0 ? 0 : 3 * i + SHOWN.image;
            }
            this.fillFilm();
            this.note.textContent = this.about();
            return this.ready.then(() => this.strip.show(this.number(this.left), this.number(this.right)));
        }

        about() {
            const of = (side) => (this[side] ? this.page.describe(this[side]) : 'reference');
            const shrunk = [...new Set([this.left, this.right])].filter((p) => p)
                .map((p) => this.strip.entries[this.number(p)].factor).filter((f) => f > 1);
            const factor = Math.max(this.scene.reference.factor, ...shrunk);
            return 'Left: ' + of('left') + '. Right: ' + of('right') + '.' +
                (factor > 1 ? ` Shrunk: a pixel stands for up to ${factor} × ${factor}.` : '');
        }

        // Returns the reference, Pareto-optimal points and the selected ones, fastest first.
        filmed() {
            const wanted = (p) => p.best || p === this.left || p === this.right;
            return [null, ...this.points.filter((p) => wanted(p) && !this.page.hidden.has(p.method))
                .sort((a, b) => a.seconds - b.seconds)];
        }

        fillFilm() {
            const focused = this.cells ? this.cells.findIndex((c) => c.button === document.activeElement) : -1;
            const kept = focused < 0 ? undefined : this.cells[focused].point;
            this.film.textContent = '';
            this.cells = this.filmed().map((point) => {
                const button = parts.make('button', this.film, { type: 'button', className: 'cell' });
                const canvas = parts.make('canvas', button, {
                    width: CELL * 2, height: Math.round(CELL * 2 * this.scene.height / this.scene.width) });
                parts.make('span', button, { className: 'cell-name', textContent: point ? point.method : 'reference' });
                parts.make('span', button, { textContent: point ? parts.settings(point) : '' });
                parts.make('span', button, {
                    textContent: point ? parts.seconds(point.seconds) + ', ' + parts.percent(point.error) : '' });
                if (point) button.style.setProperty('--own', this.page.colour(point.method));
                button.classList.toggle('chosen', point === this.left || point === this.right);
                button.setAttribute('aria-pressed', String(point === this.left || point === this.right));
                button.addEventListener('click', (event) =>
                    this.page.choose(point, event.shiftKey ? 'right' : 'left', this.scene));
                if (point === kept) button.focus();
                return { button, canvas, point };
            });
            this.cells.forEach((cell) => this.strip.need(this.number(cell.point)).then(() => this.paint(cell)));
        }

        paint(cell) {
            const context = cell.canvas.getContext('2d');
            context.clearRect(0, 0, cell.canvas.width, cell.canvas.height);
            this.strip.paint(cell.canvas, this.number(cell.point), 0, cell.canvas.width);
        }

        // Paints at most once per frame, as dragging the slider asks more often.
        paintFilm() {
            if (this.asked || !this.cells) return;
            this.asked = true;
            requestAnimationFrame(() => {
                this.asked = false;
                this.cells.forEach((cell) => this.paint(cell));
            });
        }
    }
    parts.Images = Images;
})(window.studyParts);
