// Shows images of one size over each other, with a slider between two of them, a flip, zoom, and the exposure
// of radiance.
//
//   const strip = imageStrip(element, images, { left, right, stops });
//
// images is [{ name, src, kind }], where src is a data: URL of a PNG. kind is "picture" (shown as it is),
// "radiance" (mantissas above, exponents below; shown at the strip's exposure) or "coded" (the bytes of one
// `channel` are indices of the colour table that lookup() returns; value(byte) is their text). left and right
// are the indices of the first two images, stops is the initial exposure. strip.ready resolves once all
// images are loaded. There are no dependencies, no network access and no globals but imageStrip.
//
// Options for pages of many images: With factor, each pixel of the image stands for factor x factor pixels of
// the first one. listed: false excludes an image from the choice. With lazy: true only visible images are
// decoded; strip.show(left, right) shows others. choose(side, number) is called instead of showing a user's
// choice, drawn() after a change of the view.
(function () {
    'use strict';

    const KNEE = 0.8, DESATURATION = 0.15;  // as in the engine's own pictures (tone.h): exact up to that share of white
    const NOT_FINITE = 255;  // exponent of values that are not finite
    const NOT_FINITE_COLOUR = [255, 0, 255];

    // Bytes of sRGB for linear values in [0, 1], in steps finer than a byte where the curve is steepest.
    const STEPS = 16384;
    const encoded = Uint8Array.from({ length: STEPS + 1 }, (_, i) => {
        const x = i / STEPS;
        return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * Math.pow(x, 1 / 2.4) - 0.055));
    });
    const byte = (x) => encoded[x <= 0 ? 0 : x >= 1 ? STEPS : Math.round(x * STEPS)];

    // Converts linear radiance times exposure to bytes of sRGB; bright colours roll off to white and keep
    // their hue.
    function shown(r, g, b, out, at) {
        r = Math.max(0, r), g = Math.max(0, g), b = Math.max(0, b);
        const peak = Math.max(r, g, b);
        let scale = 1, white = 0;
        if (peak > KNEE) {
            const rolled = 1 - (1 - KNEE) * (1 - KNEE) / (peak + 1 - 2 * KNEE);
            const colour = 1 / (1 + DESATURATION * (peak - rolled));
            scale = rolled / peak * colour;
            white = rolled * (1 - colour);
        }
        out[at] = byte(white + scale * r);
        out[at + 1] = byte(white + scale * g);
        out[at + 2] = byte(white + scale * b);
    }

    // The scale 2^(exponent - 128) / 256 for each exponent byte.
    const SCALES = Float64Array.from({ length: 256 }, (_, e) => Math.pow(2, e - 128) / 256);

    function load(src) {
        return new Promise((resolve, reject) => {
            const image = new Image();
            image.onload = () => resolve(image);
            image.onerror = () => reject(new Error('an image of the page is damaged'));
            image.src = src;
        });
    }

    function pixels(image) {
        const canvas = document.createElement('canvas');
        canvas.width = image.naturalWidth;
        canvas.height = image.naturalHeight;
        const context = canvas.getContext('2d', { willReadFrequently: true });
        context.drawImage(image, 0, 0);
        return { canvas, data: context.getImageData(0, 0, canvas.width, canvas.height) };
    }

    // One image: its canvas at the exposure, and its value at a pixel.
    class Layer {
        constructor(entry, image) {
            this.entry = entry;
            this.name = entry.name;
            this.kind = entry.kind;
            this.factor = entry.factor || 1;
            const { canvas, data } = pixels(image);
            this.width = data.width;
            this.source = data.data;
            if (this.kind === 'radiance') {
                this.height = data.height / 2;
            } else {
                this.height = data.height;
            }
            this.canvas = canvas;
            if (this.kind === 'picture') return;
            this.canvas = document.createElement('canvas');
            this.canvas.width = this.width;
            this.canvas.height = this.height;
        }

        radiance(pixel) {
            const at = 4 * pixel, exponent = this.source[at + 4 * this.width * this.height];
            if (exponent === NOT_FINITE) return null;
            if (exponent === 0) return [0, 0, 0];
            const scale = SCALES[exponent];
            return [0, 1, 2].map((i) => (this.source[at + i] + 0.5) * scale);
        }

        // Updates the canvas if the exposure or the colours changed.
        develop(stops) {
            if (this.kind === 'picture') return;
            const how = this.kind === 'radiance' ? stops : this.entry.lookup();
            if (how === this.developed) return;
            this.developed = how;
            const context = this.canvas.getContext('2d');
            const target = context.createImageData(this.width, this.height);
            if (this.kind === 'radiance') this.expose(target.data, Math.pow(2, stops));
            else this.decode(target.data, how);
            context.putImageData(target, 0, 0);
        }

        expose(out, exposure) {
            const source = this.source, pixels = this.width * this.height;
            for (let at = 0; at < 4 * pixels; at += 4) {
                const exponent = source[at + 4 * pixels];
                const scale = exponent === 0 ? 0 : SCALES[exponent] * exposure;
                if (exponent === NOT_FINITE) out.set(NOT_FINITE_COLOUR, at);
                else shown((source[at] + 0.5) * scale, (source[at + 1] + 0.5) * scale, (source[at + 2] + 0.5) * scale, out, at);
                out[at + 3] = 255;
            }
        }

        decode(out, colours) {
            for (let at = 0; at < out.length; at += 4) {
                const entry = 3 * this.source[at + this.entry.channel];
                for (let c = 0; c < 3; ++c) out[at + c] = colours[entry + c];
                out[at + 3] = 255;
            }
        }

        // Returns the text of a pixel of the first image.
        text(x, y) {
            const pixel = Math.floor(y / this.factor) * this.width + Math.floor(x / this.factor);
            if (this.kind === 'coded') return this.entry.value(this.source[4 * pixel + this.entry.channel]);
            if (this.kind !== 'radiance') return '';
            const value = this.radiance(pixel);
            return value ? value.map((v) => v.toPrecision(3)).join(' ') : 'not finite';
        }
    }

    function make(tag, parent, properties) {
        const element = document.createElement(tag);
        Object.assign(element, properties || {});
        parent.appendChild(element);
        return element;
    }

    class Strip {
        constructor(element, images, options) {
            this.entries = images;
            this.options = options;
            this.layers = [];  // loaded layers
            this.loading = [];  // promises of the layers
            this.left = options.left || 0;
            this.right = options.right === undefined ? Math.min(1, images.length - 1) : options.right;
            this.stops = options.stops || 0;
            this.split = 0.5;
            this.zoom = 1;
            this.centre = [0.5, 0.5];
            element.classList.add('strip');
            this.build(element, images);
            const needed = options.lazy ? [0, this.left, this.right] : images.map((_, i) => i);
            this.ready = Promise.all(needed.map((i) => this.need(i))).then(() => {
                this.expose(this.stops);
                return this;
            });
        }

        // Returns the layer of an image, which is decoded when it is first needed.
        need(i) {
            if (!this.loading[i]) {
                this.loading[i] = load(this.entries[i].src).then((image) => {
                    this.layers[i] = new Layer(this.entries[i], image);
                    return this.layers[i];
                });
            }
            return this.loading[i];
        }

        show(left, right) {
            this.left = left;
            this.right = right;
            return Promise.all([this.need(0), this.need(left), this.need(right)]).then(() => this.draw());
        }

        build(element, images) {
            const bar = make('div', element, { className: 'strip-bar' });
            this.chooseLeft = this.chooser(bar, 'left', images, this.left, (i) => { this.left = i; });
            this.slider = this.range(bar, 'split', 0, 1, 0.001, this.split, (v) => this.slide(v));
            this.chooseRight = this.chooser(bar, 'right', images, this.right, (i) => { this.right = i; });
            this.flipButton = make('button', bar, { type: 'button', textContent: 'flip', title: 'or press f' });
            this.flipButton.addEventListener('click', () => this.flip());
            const label = make('label', bar, { textContent: 'exposure ' });
            this.exposure = this.range(label, 'exposure', -20, 20, 0.25, this.stops, (v) => this.expose(v));
            this.exposureText = make('span', bar, { className: 'strip-number' });
            for (const [text, factor] of [['−', 0.5], ['+', 2]]) {
                make('button', bar, { type: 'button', textContent: text, title: 'zoom' })
                    .addEventListener('click', () => this.magnify(factor));
            }
            make('button', bar, { type: 'button', textContent: 'whole' }).addEventListener('click', () => this.whole());
            this.view = make('canvas', element, { className: 'strip-view', tabIndex: 0 });
            this.view.setAttribute('role', 'img');
            this.view.setAttribute('aria-label', 'two images; f flips, + and - zoom, arrows move');
            this.status = make('div', element, { className: 'strip-status', textContent: ' ' });
            this.listen();
        }

        chooser(bar, name, images, chosen, choose) {
            const select = make('select', bar, { name, title: name });
            images.forEach((entry, i) => {
                if (entry.listed !== false) make('option', select, { value: i, textContent: entry.name });
            });
            select.value = chosen;
            select.addEventListener('change', () => {
                if (this.options.choose) return this.options.choose(name, Number(select.value));
                choose(Number(select.value));
                this.draw();
            });
            return select;
        }

        range(bar, name, least, most, step, value, act) {
            const input = make('input', bar, { type: 'range', name, min: least, max: most, step, value, title: name });
            input.addEventListener('input', () => act(Number(input.value)));
            return input;
        }

        listen() {
            const view = this.view;
            view.addEventListener('wheel', (event) => {
                event.preventDefault();
                this.magnify(event.deltaY < 0 ? 1.25 : 0.8, event);
            }, { passive: false });
            view.addEventListener('pointerdown', (event) => {
                view.setPointerCapture(event.pointerId);
                this.drag = { x: event.clientX, y: event.clientY, slide: this.nearSplit(event) };
            });
            view.addEventListener('pointermove', (event) => {
                if (this.drag) this.dragged(event);
                this.say(event);
            });
            view.addEventListener('pointerup', () => { this.drag = null; });
            view.addEventListener('pointercancel', () => { this.drag = null; });
            view.addEventListener('dblclick', () => this.whole());
            view.addEventListener('keydown', (event) => {
                if (this.key(event.key)) event.preventDefault();
            });
            new ResizeObserver(() => this.draw()).observe(view.parentElement);
        }

        // Handles a key; returns whether it has a meaning here.
        key(name) {
            const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
            if (name === 'f') this.flip();
            else if (name === '+' || name === '=') this.magnify(2);
            else if (name === '-') this.magnify(0.5);
            else if (name === '0') this.whole();
            else if (steps[name] && this.zoom > 1) this.centre = this.centre.map((c, i) => c + 0.1 * steps[name][i] / this.zoom);
            else return false;
            this.draw();
            return true;
        }

        nearSplit(event) {
            const box = this.view.getBoundingClientRect();
            return Math.abs(event.clientX - box.left - this.split * box.width) < 12;
        }

        dragged(event) {
            const box = this.view.getBoundingClientRect();
            if (this.drag.slide) {
                this.slide((event.clientX - box.left) / box.width);
                return;
            }
            const scale = this.scale();
            this.centre[0] -= (event.clientX - this.drag.x) / scale / this.layers[0].width;
            this.centre[1] -= (event.clientY - this.drag.y) / scale / this.layers[0].height;
            this.drag.x = event.clientX;
            this.drag.y = event.clientY;
            this.draw();
        }

        slide(split) {
            this.split = Math.min(1, Math.max(0, split));
            this.slider.value = this.split;
            this.draw();
        }

        // Shows all of one image, then all of the other.
        flip() {
            this.slide(this.split < 0.5 ? 1 : 0);
        }

        expose(stops) {
            this.stops = stops;
            this.exposure.value = stops;
            this.exposureText.textContent = (stops < 0 ? '' : '+') + stops.toFixed(2) + ' stops';
            this.draw();
        }

        // Zooms about the pointer, if there is one, otherwise about the centre.
        magnify(factor, event) {
            if (!this.layers[0]) return;
            const before = event ? this.place(event) : null;
            this.zoom = Math.min(64, Math.max(1, this.zoom * factor));
            if (before) {
                const after = this.place(event);
                this.centre[0] += (before[0] - after[0]) / this.layers[0].width;
                this.centre[1] += (before[1] - after[1]) / this.layers[0].height;
            }
            if (this.zoom === 1) this.centre = [0.5, 0.5];
            this.draw();
        }

        whole() {
            this.zoom = 1;
            this.centre = [0.5, 0.5];
            this.draw();
        }

        // Returns pixels of the screen per pixel of the image.
        scale() {
            return this.zoom * this.view.clientWidth / this.layers[0].width;
        }

        // Returns the pointer's position in pixels of the image.
        place(event) {
            const box = this.view.getBoundingClientRect(), scale = this.scale(), first = this.layers[0];
            return [(event.clientX - box.left - box.width / 2) / scale + this.centre[0] * first.width,
                    (event.clientY - box.top - box.height / 2) / scale + this.centre[1] * first.height];
        }

        say(event) {
            if (!this.layers[0]) return;
            const [x, y] = this.place(event).map(Math.floor), first = this.layers[0];
            if (x < 0 || y < 0 || x >= first.width || y >= first.height) return;
            const texts = [this.layers[this.left], this.layers[this.right]]
                .map((layer) => { const t = layer && layer.text(x, y); return t ? layer.name + ': ' + t : ''; });
            this.status.textContent = '(' + x + ', ' + y + ')  ' + texts.filter((t) => t).join('   ');
        }

        draw() {
            if (!this.layers[0]) return;
            const first = this.layers[0], view = this.view, ratio = window.devicePixelRatio || 1;
            const width = view.parentElement.clientWidth, height = width * first.height / first.width;
            view.style.height = height + 'px';
            view.width = Math.max(1, Math.round(width * ratio));
            view.height = Math.max(1, Math.round(height * ratio));
            const edge = this.split * view.width;
            this.paint(view, this.left, 0, edge);
            this.paint(view, this.right, edge, view.width);
            if (this.split > 0 && this.split < 1) {
                const context = view.getContext('2d');
                context.fillStyle = 'rgba(255, 255, 255, 0.9)';
                context.fillRect(edge - ratio, 0, 2 * ratio, view.height);
            }
            if (this.options.drawn) this.options.drawn();
        }

        // Paints the visible region of image i into a canvas of the same shape, between two of its columns.
        paint(canvas, i, from, to) {
            const layer = this.layers[i], first = this.layers[0];
            if (!layer || !first) return;
            layer.develop(this.stops);
            const context = canvas.getContext('2d'), scale = this.zoom * canvas.width / first.width;
            const left = canvas.width / 2 - this.centre[0] * first.width * scale;
            const top = canvas.height / 2 - this.centre[1] * first.height * scale;
            context.save();
            context.beginPath();
            context.rect(from, 0, to - from, canvas.height);
            context.clip();
            context.beginPath();
            context.rect(left, top, first.width * scale, first.height * scale);
            context.clip();
            context.imageSmoothingEnabled = scale * layer.factor < 1;
            context.drawImage(layer.canvas, left, top, layer.width * layer.factor * scale,
                              layer.height * layer.factor * scale);
            context.restore();
        }
    }

    window.imageStrip = function (element, images, options) {
        return new Strip(element, images, options || {});
    };
})();
