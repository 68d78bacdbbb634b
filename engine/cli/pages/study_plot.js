// A plot of a study on logarithmic axes, drawn by D3: seconds to the right, errors upwards, a line per
// method.
//
//   const plot = new studyParts.Plot(figure, page, { points, title, series, front, target })
//
// series(point) returns the marks of a point, [{ y, least, most, below, hollow }]; marks without y and below
// are omitted.
(function (parts) {
    'use strict';

    const MARGIN = { top: 14, right: 16, bottom: 40, left: 62 };
    const SYMBOLS = [d3.symbolCircle, d3.symbolSquare, d3.symbolTriangle, d3.symbolDiamond, d3.symbolCross,
                     d3.symbolStar, d3.symbolWye];

    parts.symbol = (method, size) => d3.symbol().type(SYMBOLS[method % SYMBOLS.length]).size(size)();

    // Returns the range of the values with some margin, over at least a factor of three.
    function domain(values) {
        const [least, most] = d3.extent(values.filter((v) => v > 0));
        if (least === undefined) return [0.01, 1];
        const air = Math.max(1.15, Math.sqrt(Math.max(1, 3 / (most / least))));
        return [least / air, most * air];
    }

    // Labels 1, 2 and 5 if there is room, otherwise decades only; marks all nine steps.
    function ticks(scale) {
        const [least, most] = scale.domain(), decades = Math.log10(most / least);
        const labelled = decades > 3.2 ? [1] : decades > 1.1 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 7];
        const every = Math.max(1, Math.ceil(decades / 9));
        const marks = [], labels = new Set();
        for (let k = Math.floor(Math.log10(least)); k <= Math.ceil(Math.log10(most)); ++k) {
            for (const m of [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9]) {
                const v = Number((m * Math.pow(10, k)).toPrecision(3));
                if (v < least || v > most) continue;
                if (m !== 1.5 || labelled.includes(1.5)) marks.push(v);
                if (labelled.includes(m) && k % every === 0) labels.add(v);
            }
        }
        return { marks, labels };
    }

    class Plot {
        constructor(figure, page, what) {
            this.page = page;
            this.what = what;
            this.figure = d3.select(figure).classed('plot', true);
            this.title = this.figure.append('figcaption');
            this.svg = this.figure.append('svg').attr('role', 'group');
            this.tip = this.figure.append('div').attr('class', 'tip').attr('aria-hidden', 'true').style('display', 'none');
            this.current = 0;  // the point that Tab focuses
            new ResizeObserver(() => this.draw()).observe(figure);
        }

        draw() {
            const width = this.figure.node().clientWidth, height = Math.max(260, Math.min(380, 0.72 * width));
            if (!width) return;
            const shown = this.what.points.filter((p) => !this.page.hidden.has(p.method));
            this.marks = shown.flatMap((point) => this.what.series(point)
                .filter((s) => s.y > 0 || s.below > 0).map((s) => ({ ...s, point })))
                .sort((a, b) => a.point.seconds - b.point.seconds);
            const target = this.what.target && this.what.target();
            this.x = d3.scaleLog().domain(domain(shown.map((p) => p.seconds))).range([MARGIN.left, width - MARGIN.right]);
            this.y = d3.scaleLog().domain(domain(this.marks.flatMap((m) => [m.y, m.below, m.most])))
                .range([height - MARGIN.bottom, MARGIN.top]);
            const title = this.what.title();
            this.title.text(title);
            this.svg.attr('width', width).attr('height', height).attr('aria-label', title + ' against seconds; arrow keys move');
            this.svg.selectAll('*').remove();
            this.axes(width, height);
            if (this.what.front) this.front(shown, width);
            const noise = this.what.floor && this.what.floor();
            if (noise > 0) this.level(noise, width, 'floor', parts.percent(noise) + ': the reference’s own noise');
            if (target) this.level(target, width, 'target', parts.percent(target) + ' wanted');
            this.lines(shown);
            this.points();
        }

        axes(width, height) {
            const axis = (scale, make, text, class_, move, grid) => {
                const { marks, labels } = ticks(scale);
                const g = this.svg.append('g').attr('class', 'axis ' + class_).attr('transform', move)
                    .call(make(scale).tickValues(marks).tickFormat((v) => (labels.has(v) ? text(v) : '')));
                g.selectAll('.tick').filter((v) => labels.has(v)).classed('labelled', true)
                    .append('line').attr('class', 'grid').attr(...grid);
            };
            axis(this.x, d3.axisBottom, parts.seconds, 'x', `translate(0,${height - MARGIN.bottom})`,
                 ['y2', MARGIN.top + MARGIN.bottom - height]);
            axis(this.y, d3.axisLeft, this.what.text(), 'y', `translate(${MARGIN.left},0)`,
                 ['x2', width - MARGIN.left - MARGIN.right]);
            this.svg.append('text').attr('class', 'axis-name').attr('x', (MARGIN.left + width - MARGIN.right) / 2)
                .attr('y', height - 4).attr('text-anchor', 'middle').text('seconds of one image');
        }

        // Draws the staircase of the Pareto front, beyond which nothing was measured.
        front(shown, width) {
            const value = this.what.front(), best = parts.front(shown.filter((p) => value(p) > 0), value);
            if (!best.length) return;
            const corners = [[this.x(best[0].seconds), MARGIN.top]];
            best.forEach((p, i) => {
                corners.push([this.x(p.seconds), this.y(value(p))]);
                const next = best[i + 1];
                corners.push([next ? this.x(next.seconds) : width - MARGIN.right, this.y(value(p))]);
            });
            this.svg.append('path').attr('class', 'front').attr('d', d3.line()(corners))
                .append('title').text('Pareto front: no other point was both faster and more accurate');
        }

        level(value, width, name, text) {
            const [least, most] = this.y.domain();
            if (value < least || value > most) return;
            const y = this.y(value);
            this.svg.append('line').attr('class', 'level ' + name).attr('x1', MARGIN.left).attr('x2', width - MARGIN.right)
                .attr('y1', y).attr('y2', y);
            this.svg.append('text').attr('class', 'level-name ' + name).attr('y', y - 4)
                .attr('x', name === 'target' ? width - MARGIN.right - 2 : MARGIN.left + 4)
                .attr('text-anchor', name === 'target' ? 'end' : 'start').text(text);
        }

        lines(shown) {
            const line = d3.line().defined((m) => m && m.y > 0).x((m) => this.x(m.point.seconds)).y((m) => this.y(m.y));
            for (const points of parts.lines(shown)) {
                for (const hollow of [false, true]) {
                    const marks = points.map((p) => this.marks.find((m) => m.point === p && Boolean(m.hollow) === hollow));
                    if (marks.filter((m) => m && m.y > 0).length < 2) continue;
                    this.svg.append('path').datum(marks).attr('class', 'line' + (hollow ? ' hollow' : ''))
                        .style('stroke', this.page.colour(points[0].method)).attr('d', line);
                }
            }
        }

        points() {
            const top = this.y.range()[1];
            const all = this.svg.selectAll('g.point').data(this.marks).join('g')
                .attr('class', (m) => 'point' + (m.hollow ? ' hollow' : '') + (m.y > 0 ? '' : ' below'))
                .attr('transform', (m) => `translate(${this.x(m.point.seconds)},${this.y(m.y || m.below)})`)
                .attr('role', 'button').attr('tabindex', (m, i) => (i === this.current ? 0 : -1))
                .attr('aria-label', (m) => this.page.describe(m.point))
                .style('--own', (m) => this.page.colour(m.point.method));
            all.filter((m) => m.most > m.y).append('line').attr('class', 'whisker')
                .attr('y1', (m) => this.y(m.most) - this.y(m.y))
                .attr('y2', (m) => (m.least > 0 ? Math.min(this.y.range()[0], this.y(m.least)) : this.y.range()[0]) - this.y(m.y));
            all.append('circle').attr('class', 'near').attr('r', 11);
            all.append('circle').attr('class', 'ring').attr('r', 9);
            all.append('path').attr('class', 'mark')
                .attr('d', (m) => (m.y > 0 ? parts.symbol(this.page.number(m.point.method), m.point.best ? 90 : 55)
                                           : 'M-5,-4H5L0,5Z'));
            all.on('mouseenter focus', (m) => this.tell(m)).on('mouseleave blur', () => this.tip.style('display', 'none'))
                .on('click', (m) => this.page.choose(m.point, d3.event.shiftKey ? 'right' : 'left'))
                .on('keydown', (m, i) => this.key(m, i));
            this.mark();
        }

        // Marks the selected points and the fastest one.
        mark() {
            this.svg.selectAll('g.point').classed('chosen', (m) => this.page.isChosen(m.point))
                .classed('fastest', (m) => this.page.isFastest(m.point))
                .attr('aria-pressed', (m) => String(this.page.isChosen(m.point)));
        }

        key(mark, i) {
            const key = d3.event.key, step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[key];
            if (step) {
                const nodes = this.svg.selectAll('g.point').nodes();
                this.current = (i + step + nodes.length) % nodes.length;
                nodes.forEach((node, k) => node.setAttribute('tabindex', k === this.current ? 0 : -1));
                nodes[this.current].focus();
            } else if (key === 'Enter' || key === ' ') {
                this.page.choose(mark.point, d3.event.shiftKey ? 'right' : 'left');
            } else {
                return;
            }
            d3.event.preventDefault();
        }

        tell(mark) {
            const x = this.x(mark.point.seconds), y = this.y(mark.y || mark.below), width = this.figure.node().clientWidth;
            const svg = this.svg.node();
            this.tip.html('').style('display', 'block').style('top', svg.offsetTop + y + 14 + 'px');
            for (const line of this.page.lines(mark.point)) this.tip.append('div').text(line);
            const half = this.tip.node().offsetWidth / 2;
            this.tip.style('left', Math.max(0, Math.min(width - 2 * half, x - half)) + 'px');
        }
    }
    parts.Plot = Plot;
})(window.studyParts);
