// Formats a study's numbers and derives others. The scripts of the page share one object.
window.studyParts = {};
(function (parts) {
    'use strict';

    // Formats three digits, without an exponent where people would not write one.
    function digits(x) {
        if (x === 0) return '0';
        const size = Math.abs(x);
        if (size >= 1000 && size < 1e6) return x.toFixed(0);
        if (size >= 0.001 && size < 1000) return String(Number(x.toPrecision(size < 10 ? 2 : 3)));
        return x.toExponential(1);
    }
    parts.percent = (share) => digits(100 * share) + ' %';
    parts.plain = digits;

    parts.seconds = (s) => {
        if (s < 0.1) return digits(1000 * s) + ' ms';
        if (s < 120) return digits(s) + ' s';
        if (s < 7200) return digits(s / 60) + ' min';
        return digits(s / 3600) + ' h';
    };

    // Returns the known bias: { value } if it is significant, otherwise { below } or nothing.
    parts.bias = (point) => {
        const b = point.bias2;
        if (!b) return {};
        const room = b.error === null ? 0 : 2 * b.error;
        if (b.value > room) {
            return { value: Math.sqrt(b.value), least: Math.sqrt(b.value - room), most: Math.sqrt(b.value + room) };
        }
        const most = Math.max(0, b.value) + room;
        return most > 0 ? { below: Math.sqrt(most) } : {};
    };
    parts.noise = (point) => {
        const n = point.noise2;
        if (!n || !(n.value > 0)) return {};
        const room = n.error === null ? 0 : 2 * n.error;
        return { value: Math.sqrt(n.value), least: Math.sqrt(Math.max(0, n.value - room)),
                 most: Math.sqrt(n.value + room) };
    };
    parts.error = (point) => {
        const room = 2 * (point.error2_error || 0), square = point.error * point.error;
        return { value: point.error, least: Math.sqrt(Math.max(0, square - room)), most: Math.sqrt(square + room) };
    };
    // Returns the share of the squared error that more time does not reduce.
    parts.biasShare = (point) => {
        const b = parts.bias(point);
        return b.value === undefined || !(point.error > 0) ? null : Math.min(1, b.value * b.value / (point.error * point.error));
    };

    parts.measures = {
        error: { name: 'error', of: (point) => point.error, text: parts.percent },
        flip: { name: 'FLIP', of: (point) => point.flip, text: digits },
    };

    // Returns the Pareto-optimal points, fastest first.
    parts.front = (points, value) => points
        .filter((p) => !points.some((q) => q.seconds <= p.seconds && value(q) <= value(p) &&
            (q.seconds < p.seconds || value(q) < value(p))))
        .sort((a, b) => a.seconds - b.seconds);

    parts.fastest = (points, target) => points
        .filter((p) => p.error <= target)
        .reduce((best, p) => (best && best.seconds <= p.seconds ? best : p), null);

    // Tells whether a setting ends a render: samples per pixel, or a time in seconds ("5s").
    parts.endsRender = (key) => key === 'spp' || key === 'time';

    // Groups points into lines: points of a method that differ only in samples or time, in that order; or, if
    // that leaves only single points, all points of a method in the description's order.
    parts.lines = (points) => {
        const samples = (point) => parseFloat(point.set.find(([key]) => parts.endsRender(key))[1]);
        const bySamples = (list) => list.slice().sort((a, b) => samples(a) - samples(b));
        const grouped = (list, key) => {
            const groups = new Map();
            for (const point of list) groups.set(key(point), (groups.get(key(point)) || []).concat([point]));
            return [...groups.values()];
        };
        const others = (point) => JSON.stringify(
            [point.set.filter(([key]) => !parts.endsRender(key)), point.set.find(([key]) => parts.endsRender(key))[0]]);
        return grouped(points, (p) => p.method).flatMap((own) => {
            const lines = grouped(own, others);
            return lines.every((line) => line.length === 1) ? [own] : lines.map(bySamples);
        });
    };

    parts.settings = (point) => point.set.map(([key, value]) => key + '=' + value).join(' ');

    parts.make = (tag, parent, properties) => {
        const element = document.createElement(tag);
        Object.assign(element, properties || {});
        if (parent) parent.appendChild(element);
        return element;
    };
})(window.studyParts);
