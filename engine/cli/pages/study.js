// The page of `lucerna study`: studyPage(study) builds it from its numbers and pictures.
//
// study is { title, seeds, methods, scenes: [{ name, width, height, stops, reference, points }], code,
// signed, flip }, written by engine/cli/study/study_page.cpp. The page stores only what is shown and uses no
// network.
(function (parts) {
    'use strict';

    const TARGETS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5];
    const COLOURS = 8;  // study.css

    parts.label = (point) => point.method + ' · ' + parts.settings(point);

    class StudyPage {
        constructor(study) {
            this.study = study;
            this.hidden = new Set();  // methods
            this.measure = 'error';
            this.shown = 'image';  // of a point: image, error or flip
            study.points = study.scenes.flatMap((scene) => scene.points.map((p) => Object.assign(p, { scene })));
            this.target = this.firstTarget();
            this.paintRange(0.5);
            this.controls(document.getElementById('controls'));
            this.sentences = parts.make('ul', document.getElementById('sentences'));
            this.scenes = study.scenes.map((scene) => this.section(scene));
            this.table = new parts.Table(document.getElementById('table'), this);
            this.aim(this.target);
            for (const one of this.scenes) {
                one.images.left = parts.fastest(one.scene.points, this.target) || parts.front(one.scene.points, (p) => p.error).pop();
            }
            this.marks();
            this.ready = Promise.all(this.scenes.map((one) => one.images.update()));
        }

        // Returns the smallest target that a point of every scene reaches, or else that any point reaches.
        firstTarget() {
            const reached = (all) => TARGETS.find((t) => this.study.scenes[all ? 'every' : 'some'](
                (scene) => parts.fastest(scene.points, t)));
            return reached(true) || reached(false) || 1;
        }

        number(method) { return this.study.methods.indexOf(method); }
        colour(method) { return `var(--method-${this.number(method) % COLOURS})`; }
        describe(point) {
            return `${point.method}, ${parts.settings(point)}: ${parts.seconds(point.seconds)}, error ${parts.percent(point.error)}`;
        }
        // Returns the lines of a tooltip.
        lines(point) {
            const bias = parts.bias(point), noise = parts.noise(point);
            const lines = [point.method, parts.settings(point),
                           parts.seconds(point.seconds) + ', error ' + parts.percent(point.error)];
            if (noise.value !== undefined) {
                const known = bias.value !== undefined ? parts.percent(bias.value)
                    : bias.below !== undefined ? 'below ' + parts.percent(bias.below) : 'not told from none';
                lines.push('bias ' + known + ', noise ' + parts.percent(noise.value));
            }
            if (point.flip !== null) lines.push('FLIP ' + parts.plain(point.flip) + ', mean / reference ' + point.ratio.toFixed(4));
            return lines;
        }

        controls(element) {
            const legend = parts.make('div', element, { className: 'legend' });
            legend.setAttribute('role', 'group');
            legend.setAttribute('aria-label', 'methods');
            for (const method of this.study.methods) {
                const button = parts.make('button', legend, { type: 'button', title: 'show or hide' });
                button.style.setProperty('--own', this.colour(method));
                button.innerHTML = `<svg width="18" height="16" viewBox="-9 -8 18 16" aria-hidden="true"><path class="mark" d="${parts.symbol(this.number(method), 80)}"/></svg>`;
                parts.make('span', button, { textContent: method });
                button.setAttribute('aria-pressed', 'true');
                button.addEventListener('click', () => this.toggle(method, button));
            }
            const front = parts.make('span', legend, { className: 'front-key' });
            front.innerHTML = '<svg width="26" height="12" aria-hidden="true"><path class="front" d="M2,2V9H24"/></svg>Pareto front';
            const bar = parts.make('div', element, { className: 'choices' });
            this.targetControl(bar);
            this.radio(bar, 'plotted', { error: 'error', flip: 'FLIP' }, this.measure, (m) => { this.measure = m; this.draw(); });
            this.radio(bar, 'shown', { image: 'image', error: 'signed error', flip: 'FLIP' }, this.shown, (s) => this.show(s));
            this.scale(bar);
        }

        targetControl(bar) {
            const label = parts.make('label', bar, { textContent: 'error wanted ' });
            this.targetSlider = parts.make('input', label, { type: 'range', name: 'target', min: -3, max: 0, step: 0.01 });
            this.targetText = parts.make('output', label, { className: 'strip-number' });
            this.targetSlider.addEventListener('input', () =>
                this.aim(Number(Math.pow(10, Number(this.targetSlider.value)).toPrecision(2))));
        }

        radio(bar, name, choices, chosen, act) {
            const group = parts.make('span', bar, { className: 'radio' });
            group.setAttribute('role', 'radiogroup');
            group.setAttribute('aria-label', name);
            parts.make('span', group, { textContent: name + ' ' });
            for (const [value, text] of Object.entries(choices)) {
                const label = parts.make('label', group);
                const input = parts.make('input', label, { type: 'radio', name, value, checked: value === chosen });
                parts.make('span', label, { textContent: text });
                input.addEventListener('change', () => act(value));
            }
        }

        // Adds the legend of the maps' colours.
        scale(bar) {
            this.scaleBar = parts.make('span', bar, { className: 'map-scale' });
            this.scaleLeast = parts.make('span', this.scaleBar);
            this.scaleView = parts.make('canvas', this.scaleBar, { width: 256, height: 1 });
            this.scaleMost = parts.make('span', this.scaleBar);
            this.rangeSlider = parts.make('input', this.scaleBar, {
                type: 'range', name: 'range', min: -2, max: 1, step: 0.02, value: Math.log10(this.range), title: 'error in full colour' });
            this.rangeSlider.addEventListener('input', () => {
                this.paintRange(Math.pow(10, Number(this.rangeSlider.value)));
                this.showScale();
                this.scenes.forEach((one) => one.images.strip.draw());
            });
            this.showScale();
        }

        showScale() {
            this.scaleBar.style.display = this.shown === 'image' ? 'none' : '';
            this.rangeSlider.style.display = this.shown === 'error' ? '' : 'none';
            const of = this.shown === 'error';
            this.scaleLeast.textContent = of ? '−' + parts.percent(this.range) : '0';
            this.scaleMost.textContent = of ? '+' + parts.percent(this.range) : '1';
            const context = this.scaleView.getContext('2d'), row = context.createImageData(256, 1);
            const palette = of ? this.study.signed : this.study.flip;
            for (let i = 0; i < 256; ++i) row.data.set([...palette.slice(3 * i, 3 * i + 3), 255], 4 * i);
            context.putImageData(row, 0, 0);
        }

        // Sets the colours of coded errors; `range` has full colour.
        paintRange(range) {
            this.range = range;
            this.errorColours = new Uint8Array(3 * 256);
            for (let byte = 0; byte < 256; ++byte) {
                const share = Math.max(-1, Math.min(1, parts.decodeError(byte, this.study.code) / range));
                const at = 3 * (128 + Math.round(127 * share));
                this.errorColours.set(this.study.signed.slice(at, at + 3), 3 * byte);
            }
        }

        section(scene) {
            const section = parts.make('section', document.getElementById('scenes'));
            parts.make('h2', section, { textContent: scene.name });
            const plots = parts.make('div', section, { className: 'plots' });
            const one = { scene, plots: [] };
            const measure = () => parts.measures[this.measure];
            one.plots.push(new parts.Plot(parts.make('figure', plots), this, {
                points: scene.points,
                title: () => (this.measure === 'flip' ? 'FLIP' : 'Error'),
                text: () => measure().text,
                series: (p) => [this.measure === 'error' ? { ...parts.error(p), y: p.error } : { y: p.flip }],
                front: () => measure().of,
                floor: () => (this.measure === 'error' ? scene.noise : 0),
                target: () => (this.measure === 'error' ? this.target : null),
            }));
            if (this.study.seeds > 1) {
                one.plots.push(new parts.Plot(parts.make('figure', plots), this, {
                    points: scene.points,
                    title: () => 'Bias (filled; ▽ below) and noise (hollow)',
                    text: () => parts.percent,
                    series: (p) => {
                        const bias = parts.bias(p), noise = parts.noise(p);
                        return [{ ...noise, y: noise.value, hollow: true }, { ...bias, y: bias.value }];
                    },
                }));
            }
            parts.make('p', section, { className: 'hint', textContent:
                'Hover over a point to see its settings; click to show its image on the left, shift-click on the right.' });
            if (this.study.seeds === 2) {
                parts.make('p', section, { className: 'hint', textContent:
                    'With two seeds the bias has no standard error and may be noise; use three or more seeds to separate them.' });
            }
            one.images = new parts.Images(parts.make('div', section, { className: 'images' }), scene, this);
            return one;
        }

        of(scene) { return this.scenes.find((one) => one.scene === scene); }
        isChosen(point) {
            const { images } = this.of(point.scene);
            return images.left === point || images.right === point;
        }
        isFastest(point) { return this.of(point.scene).fastest === point; }

        // A null `point` is the scene's reference.
        choose(point, side, scene) {
            const { images } = this.of(point ? point.scene : scene);
            images.choose(point, side);
            this.marks();
        }

        aim(target) {
            this.target = target;
            this.targetSlider.value = Math.log10(target);
            this.targetText.textContent = parts.percent(target);
            this.sentences.textContent = '';
            for (const one of this.scenes) {
                one.fastest = parts.fastest(one.scene.points.filter((p) => !this.hidden.has(p.method)), target);
                this.sentence(one);
            }
            this.draw();
        }

        sentence(one) {
            const item = parts.make('li', this.sentences), best = one.fastest;
            const say = (text, tag) => parts.make(tag || 'span', item, { textContent: text });
            if (!best) {
                const least = Math.min(...one.scene.points.map((p) => p.error));
                say(`On ${one.scene.name} no point is within ${parts.percent(this.target)}; the best is ${parts.percent(least)}.`);
                return;
            }
            say(`For ${parts.percent(this.target)} error on ${one.scene.name} the fastest is `);
            const link = parts.make('button', item, { type: 'button', className: 'link',
                                                      textContent: `${best.method}, ${parts.settings(best)}` });
            link.addEventListener('click', () => this.choose(best, 'left'));
            say(` (${parts.seconds(best.seconds)}).`);
        }

        toggle(method, button) {
            if (!this.hidden.delete(method)) this.hidden.add(method);
            button.setAttribute('aria-pressed', String(!this.hidden.has(method)));
            this.aim(this.target);
            this.scenes.forEach((one) => one.images.update());
            this.marks();
        }

        show(shown) {
            this.shown = shown;
            this.showScale();
            this.scenes.forEach((one) => one.images.update());
        }

        draw() { this.scenes.forEach((one) => one.plots.forEach((plot) => plot.draw())); }
        marks() {
            this.scenes.forEach((one) => one.plots.forEach((plot) => plot.mark()));
            this.table.mark();
        }
    }

    window.studyPage = (study) => new StudyPage(study);
})(window.studyParts);
