"use strict";
// Puts a chart that can be touched in the place of each static figure when it comes into sight.
(function () {
  const scenarios = new Map(JSON.parse(document.getElementById("chart-data").textContent).map((data) => [data.scenario, data]));
  const states = new Map(Array.from(scenarios.keys(), (name) => [name, { hidden: new Set(), byError: false, drawn: [] }]));
  const { Plotting } = Bokeh;

  function css(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }

  function figureOf(options) {
    const figure = Plotting.figure({
      sizing_mode: "stretch_both", tools: "pan,box_zoom,wheel_zoom,reset,save", toolbar_location: "right",
      background_fill_color: null, border_fill_color: null, outline_line_color: null, min_border: 4, ...options,
    });
    figure.toolbar.logo = null;
    figure.toolbar.autohide = true;
    if (figure.title) { figure.title.text_color = css("--ink"); figure.title.text_font_size = "12px"; }
    for (const axis of [...figure.below, ...figure.left]) {
      axis.axis_line_color = css("--muted");
      axis.major_tick_line_color = css("--muted");
      axis.minor_tick_line_color = null;
      axis.major_label_text_color = css("--ink");
      axis.axis_label_text_color = css("--ink");
      axis.axis_label_text_font_style = "normal";
      axis.axis_label_text_font_size = "11px";
    }
    for (const grid of figure.center.filter((one) => one instanceof Bokeh.Grid)) grid.grid_line_color = css("--line");
    // Axes fit the controllers that are shown.
    for (const range of [figure.x_range, figure.y_range]) if (range instanceof Bokeh.DataRange1d) range.only_visible = true;
    return figure;
  }
  function labels(data, kind) {
    const [x_axis_label, y_axis_label] = data.axes[kind];
    return { x_axis_label, y_axis_label };
  }
  function hover(figure, renderers, tooltips, options) {
    figure.add_tools(new Bokeh.HoverTool({ renderers, tooltips, ...options }));
  }
  // What belongs to a controller is shown or hidden by the buttons above the figures.
  function own(state, renderer, controller, isShown) {
    const apply = () => { renderer.visible = !state.hidden.has(controller) && (isShown ? isShown() : true); };
    state.drawn.push(apply);
    apply();
    return renderer;
  }
  // A line has a gap where there is no number.
  function numbers(values) {
    return values.map((value) => (value === null ? NaN : value));
  }
  function columns(trial, data) {
    const n = trial.x.length;
    const fill = (value) => Array(n).fill(value);
    return new Bokeh.ColumnDataSource({ data: {
      x: numbers(trial.x), y: numbers(trial.y), time: trial.time, error: trial.error, driven: trial.driven || fill(null),
      clearance: trial.clearance || fill(null), who: fill(data.controllers[trial.controller]),
      trial: fill(`${trial.trial}, ${trial.outcome}`),
    } });
  }
  const TRIAL_TIPS = [["", "@who"], ["trial", "@trial"], ["time", "@time{0.0} s"], ["from the plan", "@error{0.000} m"], ["clearance", "@clearance{0.00} m"]];

  const charts = {
    paths(data, state) {
      const figure = figureOf({ match_aspect: true, ...labels(data, "paths") });
      const [x0, x1, y0, y1] = data.bounds;
      figure.scatter([x0, x1], [y0, y1], { alpha: 0, size: 1 });
      if (data.walls.length) {
        // A wall far from all that happened must not make the rest small.
        const walls = figure.patches(data.walls.map((wall) => wall[0]), data.walls.map((wall) => wall[1]), { fill_color: css("--faint"), line_color: css("--muted"), fill_alpha: 0.6 });
        for (const range of [figure.x_range, figure.y_range]) range.renderers = figure.renderers.filter((one) => one !== walls);
      }
      for (const [x, y] of data.plans) figure.line(x, y, { line_color: css("--ink"), line_dash: "dashed" });
      figure.scatter(data.goals.map((goal) => goal[0]), data.goals.map((goal) => goal[1]), { marker: "star", size: 14, fill_color: css("--paper"), line_color: css("--ink") });
      const lines = [];
      const worst = Math.max(1e-3, ...data.trials.flatMap((trial) => trial.error.filter((error) => error !== null)));
      const mapper = new Bokeh.LinearColorMapper({ palette: Bokeh.Palettes.Viridis256 || Bokeh.Palettes.viridis256, low: 0, high: worst });
      for (const trial of data.trials) {
        const source = columns(trial, data);
        lines.push(own(state, figure.line({ field: "x" }, { field: "y" }, { source, line_color: data.colors[trial.controller], line_width: 2, line_alpha: trial.arrived ? 0.9 : 0.5 }), trial.controller, () => !state.byError));
        const pieces = new Bokeh.ColumnDataSource({ data: { x0: numbers(trial.x.slice(0, -1)), y0: numbers(trial.y.slice(0, -1)), x1: numbers(trial.x.slice(1)), y1: numbers(trial.y.slice(1)), error: trial.error.slice(1) } });
        own(state, figure.segment({ field: "x0" }, { field: "y0" }, { field: "x1" }, { field: "y1" }, { source: pieces, line_width: 4, line_color: { field: "error", transform: mapper } }), trial.controller, () => state.byError);
      }
      // Its own ticks: those that Bokeh picks are round, and of so short a scale often only the 0.
      const ticker = new Bokeh.FixedTicker({ ticks: [0, worst / 2, worst] }), formatter = new Bokeh.PrintfTickFormatter({ format: "%.2g" });
      const bar = new Bokeh.ColorBar({ color_mapper: mapper, ticker, formatter, title: "from the plan [m]", height: 8, width: 120, background_fill_alpha: 0, major_label_text_color: css("--ink"), title_text_color: css("--ink"), orientation: "horizontal", location: "top_left" });
      figure.add_layout(bar);
      state.drawn.push(() => { bar.visible = state.byError; });
      bar.visible = state.byError;
      hover(figure, lines, TRIAL_TIPS, { line_policy: "nearest" });
      return [figure];
    },
    clearance(data, state) {
      const figure = figureOf(labels(data, "clearance"));
      figure.add_layout(new Bokeh.BoxAnnotation({ top: data.danger, fill_color: "#d9534f", fill_alpha: 0.15, line_color: null }));
      const lines = data.trials.filter((trial) => trial.clearance && trial.clearance.some((value) => value !== null)).map((trial) =>
        own(state, figure.line({ field: "driven" }, { field: "clearance" }, { source: columns(trial, data), line_color: data.colors[trial.controller], line_width: 1.5 }), trial.controller));
      hover(figure, lines, TRIAL_TIPS, { line_policy: "nearest" });
      return [figure];
    },
    metrics(data, state) {
      return data.metrics.filter((metric) => metric.values.length).map((metric) => {
        const unit = metric.unit ? ` [${metric.unit}]` : "";
        const arrow = { lower: " ↓", higher: " ↑" }[metric.better] || "";
        const figure = figureOf({ title: `${metric.title}${unit}${arrow}`, x_range: new Bokeh.Range1d({ start: -0.6, end: data.controllers.length - 0.4 }), toolbar_location: null });
        for (const one of [...figure.below, ...figure.center.filter((part) => part instanceof Bokeh.Grid && part.dimension === 0)]) one.visible = false;
        const dots = data.controllers.map((name, controller) => {
          const values = metric.values.filter((value) => value[0] === controller);
          const spread = (index) => controller + (values.length > 1 ? 0.4 * (index / (values.length - 1) - 0.5) : 0);
          const source = new Bokeh.ColumnDataSource({ data: {
            x: values.map((_, index) => spread(index)), y: values.map((value) => value[2]), who: values.map(() => name),
            trial: values.map((value) => value[1]), ended: values.map((value) => (value[3] ? "arrived" : "did not arrive")),
          } });
          // A click on a dot opens the trial's replay, or shows the command that makes it.
          source.selected.change.connect(() => {
            const [index] = source.selected.indices;
            if (index === undefined) return;
            source.selected.indices = [];
            showTrial(data.scenario, name, source.data.trial[index]);
          });
          return own(state, figure.scatter({ field: "x" }, { field: "y" }, { source, size: 8, line_color: data.colors[controller], fill_color: values.map((value) => (value[3] ? data.colors[controller] : "transparent")), alpha: 0.85 }), controller);
        });
        hover(figure, dots, [["", "@who"], ["trial", "@trial, @ended"], ["", `@y ${metric.unit}`]]);
        figure.add_tools(new Bokeh.TapTool({ renderers: dots }));
        return figure;
      });
    },
    pareto(data, state) {
      const figure = figureOf(labels(data, "pareto"));
      const jerks = data.pareto.map((point) => point[3]);
      const low = Math.min(...jerks), span = Math.max(...jerks) - low || 1;
      const dots = data.pareto.map(([controller, time, clearance, jerk, best]) => {
        const source = new Bokeh.ColumnDataSource({ data: { x: [time], y: [clearance], jerk: [jerk], who: [data.controllers[controller]] } });
        const style = { source, size: 9 + 14 * (jerk - low) / span, fill_color: data.colors[controller], line_color: best ? css("--ink") : css("--paper"), line_width: best ? 2 : 1, fill_alpha: best ? 1 : 0.55 };
        own(state, figure.text({ field: "x" }, { field: "y" }, { field: "who" }, { source, x_offset: 14, y_offset: 5, text_font_size: "11px", text_color: css("--ink") }), controller);
        return own(state, figure.scatter({ field: "x" }, { field: "y" }, style), controller);
      });
      figure.x_range.range_padding = 0.35;
      figure.y_range.range_padding = 0.35;
      hover(figure, dots, [["", "@who"], ["time", "@x{0.00} s"], ["clearance", "@y{0.000} m"], ["jerk", "@jerk{0.00} m/s³"]]);
      return [figure];
    },
    compute(data, state) {
      const figure = figureOf({ x_axis_type: "log", y_axis_type: "log", ...labels(data, "compute") });
      figure.add_layout(new Bokeh.Span({ location: data.compute.period, dimension: "height", line_color: css("--ink"), line_dash: "dashed" }));
      const lines = data.compute.curves.map(([controller, x, y]) => {
        const source = new Bokeh.ColumnDataSource({ data: { x, y, who: x.map(() => data.controllers[controller]) } });
        return own(state, figure.line({ field: "x" }, { field: "y" }, { source, line_color: data.colors[controller], line_width: 2 }), controller);
      });
      hover(figure, lines, [["", "@who"], ["at least", "@x{0.000} ms"], ["share", "@y{0.0000}"]], { line_policy: "nearest" });
      return [figure];
    },
  };

  // What is seen of a figure after somebody zoomed or moved it, until it is reset.
  function keepZoom(figure, name) {
    figure.on_event("rangesupdate", () => {
      zooms.set(name, [figure.x_range.start, figure.x_range.end, figure.y_range.start, figure.y_range.end]);
      keepState();
    });
    figure.on_event("reset", () => setTimeout(() => { zooms.delete(name); keepState(); }));
  }
  function restoreZoom(figure, name) {
    if (!zooms.has(name)) return;
    const [x0, x1, y0, y1] = zooms.get(name);
    for (const [range, start, end] of [[figure.x_range, x0, x1], [figure.y_range, y0, y1]]) {
      // Else the range would fit the data again.
      if (range instanceof Bokeh.DataRange1d) range.have_updated_interactively = true;
      range.setv({ start, end });
    }
  }

  async function draw(box) {
    const data = scenarios.get(box.dataset.scenario), make = charts[box.dataset.kind];
    if (!data || !make || (box.dataset.kind === "compute" && !data.compute)) return;
    const live = document.createElement("div");
    live.className = "live";
    box.append(live);
    const figures = make(data, states.get(data.scenario));
    const rows = Math.ceil(figures.length / 3);
    if (figures.length > 1) live.style.gridTemplateRows = `repeat(${rows}, minmax(0, 1fr))`;
    for (const figure of figures) {
      const place = document.createElement("div");
      if (figures.length === 1) place.style.cssText = "position:absolute;inset:0";
      live.append(place);
      await Plotting.show(figure, place);
      const name = `${data.scenario}.${box.dataset.kind}.${figures.indexOf(figure)}`;
      restoreZoom(figure, name);
      keepZoom(figure, name);
    }
    box.dataset.drawn = "yes";
  }

  const inSight = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      if (isIntersecting && !target.dataset.drawn) { target.dataset.drawn = "begun"; draw(target); }
    }
  }, { rootMargin: "300px" });
  const boxes = Array.from(document.querySelectorAll(".chart .box")).filter((box) => box.dataset.kind in charts);
  boxes.forEach((box) => inSight.observe(box));
  // Colours are taken from the page when a chart is drawn.
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    for (const state of states.values()) state.drawn.length = 0;
    for (const box of boxes) {
      box.querySelector(".live")?.remove();
      delete box.dataset.drawn;
      inSight.unobserve(box);
      inSight.observe(box);
    }
  });

  for (const legend of document.querySelectorAll(".legend")) {
    const data = scenarios.get(legend.dataset.scenario);
    if (!data) continue;
    const state = states.get(data.scenario);
    // Its room is kept from the start, so that nothing moves.
    legend.hidden = false;
    // The chips at the top of the page hide a controller here, too.
    const follow = () => {
      for (const button of legend.querySelectorAll("button[data-controller]")) {
        const isHidden = hiddenControllers.has(button.dataset.controller);
        button.setAttribute("aria-pressed", String(!isHidden));
        state.hidden[isHidden ? "add" : "delete"](data.controllers.indexOf(button.dataset.controller));
      }
      for (const apply of state.drawn) apply();
    };
    hiddenListeners.push(follow);
    follow();
    legend.addEventListener("click", (event) => {
      const button = event.target.closest("button");
      if (!button) return;
      const pressed = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(pressed));
      if (button.classList.contains("by-error")) state.byError = pressed;
      else state.hidden[pressed ? "delete" : "add"](data.controllers.indexOf(button.dataset.controller));
      for (const apply of state.drawn) apply();
    });
  }
})();
