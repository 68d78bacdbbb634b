// The table of all points of a study, with a column per setting, sortable by any.
(function (parts) {
    'use strict';

    // Columns are { name, text(point), value(point) }: the text shown and the sort key, where null sorts
    // last.
    function columns(study) {
        const number = (text) => Number(/^[\d.e+-]+s$/.test(text) ? text.slice(0, -1) : text);
        const numbered = (text) => (text !== '' && isFinite(number(text)) ? number(text) : text);
        const keys = [...new Set(study.points.flatMap((p) => p.set.map(([key]) => key)))];
        keys.sort((a, b) => parts.endsRender(a) - parts.endsRender(b));
        const of = (point, key) => (point.set.find(([k]) => k === key) || [key, ''])[1];
        const bounded = (part, point) => {
            if (part.value !== undefined) return parts.percent(part.value);
            return part.below !== undefined ? '< ' + parts.percent(part.below) : '';
        };
        const list = [];
        if (study.scenes.length > 1) list.push({ name: 'scene', text: (p) => p.scene.name, value: (p) => p.scene.name });
        list.push({ name: '★', text: (p) => (p.best ? '★' : ''), value: (p) => (p.best ? 0 : 1) },
                  { name: 'method', text: (p) => p.method, value: (p) => p.method, own: true });
        for (const key of keys) {
            list.push({ name: key, text: (p) => of(p, key), value: (p) => (of(p, key) === '' ? null : numbered(of(p, key))) });
        }
        list.push({ name: 'seconds', text: (p) => parts.seconds(p.seconds), value: (p) => p.seconds },
                  { name: 'error', text: (p) => parts.percent(p.error), value: (p) => p.error });
        if (study.seeds > 1) {
            const value = (part) => (part.value !== undefined ? part.value : part.below === undefined ? null : part.below);
            list.push({ name: 'bias', text: (p) => bounded(parts.bias(p), p), value: (p) => value(parts.bias(p)) },
                      { name: 'noise', text: (p) => bounded(parts.noise(p), p), value: (p) => value(parts.noise(p)) },
                      { name: 'bias share', value: parts.biasShare,
                        text: (p) => (parts.biasShare(p) === null ? '' : parts.percent(parts.biasShare(p))) });
        }
        list.push({ name: 'FLIP', text: (p) => (p.flip === null ? '' : parts.plain(p.flip)), value: (p) => p.flip },
                  { name: 'mean / reference', text: (p) => p.ratio.toFixed(4), value: (p) => p.ratio });
        return list;
    }

    function before(a, b) {
        if (a === null || b === null) return (a === null) - (b === null);
        if (typeof a === 'number' && typeof b === 'number') return a - b;
        return String(a).localeCompare(String(b));
    }

    class Table {
        constructor(element, page) {
            this.page = page;
            this.columns = columns(page.study);
            this.sorted = { column: this.columns.find((c) => c.name === 'error'), up: true };
            const table = parts.make('table', element, { className: 'points' });
            const head = parts.make('tr', parts.make('thead', table));
            for (const column of this.columns) {
                const numbers = page.study.points.some((p) => typeof column.value(p) === 'number') && column.name !== '★';
                const cell = parts.make('th', head, { scope: 'col', className: numbers ? 'number' : '' });
                parts.make('button', cell, { type: 'button', textContent: column.name })
                    .addEventListener('click', () => this.sort(column));
                column.head = cell;
            }
            this.body = parts.make('tbody', table);
            this.rows = page.study.points.map((point) => this.row(point));
            this.order();
        }

        row(point) {
            const row = parts.make('tr', null, { tabIndex: 0 });
            row.style.setProperty('--own', this.page.colour(point.method));
            for (const column of this.columns) {
                const cell = parts.make('td', row, { textContent: column.text(point) });
                if (column.own) cell.className = 'own';
                if (column.head.className === 'number') cell.classList.add('number');
            }
            row.addEventListener('click', (event) => this.page.choose(point, event.shiftKey ? 'right' : 'left'));
            row.addEventListener('keydown', (event) => {
                if (event.key !== 'Enter' && event.key !== ' ') return;
                event.preventDefault();
                this.page.choose(point, event.shiftKey ? 'right' : 'left');
            });
            return { point, row };
        }

        sort(column) {
            this.sorted = { column, up: this.sorted.column === column ? !this.sorted.up : true };
            this.order();
        }

        order() {
            const { column, up } = this.sorted;
            const missing = (r) => column.value(r.point) === null;
            this.rows.sort((a, b) => {
                const order = before(column.value(a.point), column.value(b.point));
                return missing(a) || missing(b) || up ? order : -order;
            });
            for (const { row } of this.rows) this.body.appendChild(row);
            for (const one of this.columns) {
                one.head.setAttribute('aria-sort', one !== column ? 'none' : up ? 'ascending' : 'descending');
            }
        }

        mark() {
            for (const { point, row } of this.rows) {
                row.classList.toggle('chosen', this.page.isChosen(point));
                row.classList.toggle('faint', this.page.hidden.has(point.method));
            }
        }
    }
    parts.Table = Table;
})(window.studyParts);
