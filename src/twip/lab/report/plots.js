// The panels: BokehJS draws axes, lines and the zoom box; ranges, legends and cursors are set here.

const LEFT = 62, RIGHT = 12;

// With as many decimals as four digits of the largest value that `size` names need.
function number(value, size = Math.abs(value)) {
  if (!Number.isFinite(value)) return "–";
  const far = size > 0 && (size >= 1e6 || size < 1e-3);
  const decimals = Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(size || 1))));
  const text = far ? value.toExponential(3) : value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replaceAll("-", "−");
}

// Short labels, so that the frames of all panels begin at one place.
function ticks(values) {
  const size = Math.max(...values.map(Math.abs)), steps = values.slice(1).map((v, i) => Math.abs(v - values[i]));
  const step = Math.min(...steps.filter(s => s > 0), size || 1);
  const small = size > 0 && size < 1e-2, big = size >= 1e5;
  const decimals = Math.max(0, Math.min(9, -Math.floor(Math.log10(step) + 1e-9)));
  return values.map(v => {
    if (!v) return "0";
    return (small || big ? `${Number(v.toPrecision(3)).toExponential()}` : v.toFixed(decimals)).replace("e+", "e").replaceAll("-", "−");
  });
}

function magnitude(values) {
  let size = 0;
  for (const value of values) if (Math.abs(value) > size) size = Math.abs(value);
  return size;
}

class Plots {
  constructor(panels, samples, from, to) {
    this.samples = samples;
    this.whole = {from, to};
    this.box = document.getElementById("panels");
    this.range = new Bokeh.Range1d({start: from, end: to, bounds: [from, to], min_interval: 1e-6});
    this.document = new Bokeh.Document();
    this.panels = panels.map((panel, i) => this.panel(panel, i === panels.length - 1));
  }

  async show() {
    const element = document.createElement("div");
    const views = await Bokeh.embed.add_document_standalone(this.document, element, this.panels.map(p => p.place));
    for (const panel of this.panels) panel.view = views.get(panel.figure) ?? views.find_one(panel.figure);
    let waiting = false;
    const changed = () => {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => { waiting = false; this.draw(); });
    };
    this.range.change.connect(changed);
    new ResizeObserver(changed).observe(this.box);
    document.getElementById("reset").onclick = () => this.zoom(this.whole.from, this.whole.to);
    this.box.addEventListener("wheel", event => this.wheel(event), {passive: false});
    this.draw();
  }

  panel({title, unit, lines, note}, last) {
    const figure = new Bokeh.Plotting.figure({
      x_range: this.range, y_range: new Bokeh.Range1d({start: 0, end: 1}), height: last ? 156 : 140,
      sizing_mode: "stretch_width", tools: [], toolbar_location: null, output_backend: "canvas",
      min_border_left: LEFT, min_border_right: RIGHT, min_border_top: 4, min_border_bottom: 22, outline_line_color: null,
    });
    figure.add_tools(new Bokeh.BoxZoomTool({dimensions: "width"}));
    for (const axis of [figure.xaxis, figure.yaxis]) {
      Object.assign(axis, {
        axis_line_color: null, minor_tick_line_color: null, major_tick_line_color: null,
        major_label_text_color: "#767676", major_label_text_font_size: "11px", major_label_standoff: 4,
      });
    }
    figure.yaxis.formatter = Object.assign(new Bokeh.BasicTickFormatter(), {doFormat: ticks});
    figure.yaxis.ticker = new Bokeh.BasicTicker({desired_num_ticks: 4});
    if (last) Object.assign(figure.xaxis, {axis_label: "time [s]", axis_label_text_color: "#767676", axis_label_text_font_size: "11px", axis_label_text_font_style: "normal", axis_label_standoff: 1});
    for (const grid of [figure.xgrid, figure.ygrid]) grid.grid_line_color = "#ededed";
    const drawn = lines.map(line => {
      const source = new Bokeh.ColumnDataSource({data: {x: [], y: []}});
      const glyph = figure.line({field: "x"}, {field: "y"}, {
        source, line_color: line.color, line_width: line.width, line_alpha: line.alpha, line_dash: line.dash, line_join: "round",
      });
      const series = this.samples.series[line.series];
      return {...line, series, size: magnitude(series.values), source, glyph, shown: true};
    });
    const element = document.createElement("div"), head = document.createElement("div"), place = document.createElement("div");
    element.className = "panel"; head.className = "head"; place.className = "plot";
    place.style.height = `${last ? 156 : 140}px`;
    const name = document.createElement("b");
    name.textContent = unit ? `${title} [${unit}]` : title;
    head.append(name);
    const panel = {figure, lines: drawn, place, unit};
    for (const line of drawn) {
      const button = document.createElement("button"), mark = document.createElement("i"), text = document.createElement("span");
      line.out = document.createElement("span");
      line.out.className = "value";
      mark.style.borderTopColor = line.color;
      mark.style.borderTopStyle = line.dash.length ? "dashed" : "solid";
      mark.style.borderTopWidth = `${Math.max(1.5, line.width)}px`;
      mark.style.opacity = line.alpha;
      text.textContent = line.label;
      button.title = line.source || line.label;
      button.append(mark, text, line.out);
      button.onclick = () => {
        line.shown = !line.shown;
        line.glyph.visible = line.shown;
        button.classList.toggle("off", !line.shown);
        this.draw();
      };
      head.append(button);
    }
    element.append(head, place);
    if (note) {
      const text = document.createElement("p");
      text.className = "note";
      text.textContent = note;
      element.append(text);
    }
    this.box.append(element);
    this.document.add_root(figure);
    return panel;
  }

  get width() { return Math.max(50, this.box.clientWidth - LEFT - RIGHT); }
  get frame() {
    const bbox = this.panels[0]?.view?.frame?.bbox;
    return bbox && bbox.width > 0 ? {left: bbox.left, width: bbox.width} : {left: LEFT, width: this.width};
  }

  // Fill the lines with what is visible, and fit the vertical ranges to it.
  draw() {
    const {start, end} = this.range;
    for (const {figure, lines} of this.panels) {
      let low = Infinity, high = -Infinity;
      for (const line of lines) {
        if (!line.shown) continue;
        const data = line.series.visible(start, end, this.width);
        line.source.data = data;
        for (let i = 0; i < data.x.length; i++) {
          if (data.x[i] < start || data.x[i] > end) continue;
          if (data.y[i] < low) low = data.y[i];
          if (data.y[i] > high) high = data.y[i];
        }
      }
      if (low > high) [low, high] = [-1, 1];
      const least = Math.max(1e-9, 1e-6 * Math.max(Math.abs(low), Math.abs(high)));
      const pad = high - low > least ? 0.07 * (high - low) : 0.1 * Math.abs(high) || 1;
      figure.y_range.setv({start: low - pad, end: high + pad});
    }
    document.getElementById("reset").disabled = start <= this.whole.from && end >= this.whole.to;
    this.moved?.();
  }

  zoom(from, to) {
    const {from: first, to: last} = this.whole, width = Math.min(last - first, Math.max(to - from, 1e-5));
    const start = Math.max(first, Math.min(last - width, from));
    this.range.setv({start, end: start + width});
  }

  wheel(event) {
    if (!event.ctrlKey && !event.shiftKey) return;
    event.preventDefault();
    const {start, end} = this.range, turn = event.deltaY || event.deltaX;
    if (event.shiftKey) return this.zoom(start + 0.0015 * turn * (end - start), end + 0.0015 * turn * (end - start));
    const centre = this.time(event.clientX), scale = Math.exp(0.0015 * turn);
    this.zoom(centre - scale * (centre - start), centre + scale * (end - centre));
  }

  time(clientX) {
    const {left, width} = this.frame, {start, end} = this.range;
    return start + (end - start) * (clientX - this.box.getBoundingClientRect().left - left) / width;
  }

  // Put a line (cursor or pointer) where a time is; out of sight where the time is not visible.
  mark(element, time) {
    const {left, width} = this.frame, {start, end} = this.range, share = (time - start) / (end - start);
    element.hidden = !(share >= -1e-9 && share <= 1 + 1e-9);
    element.style.left = `${left + share * width}px`;
  }

  tell(time) {
    for (const {lines, unit} of this.panels) {
      for (const line of lines) {
        const value = line.series.value(time);
        line.out.textContent = `${number(value, line.size)}${unit && Number.isFinite(value) ? (unit === "°" ? "°" : ` ${unit}`) : ""}`;
      }
    }
  }
}
