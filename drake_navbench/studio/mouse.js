const view = Bokeh.index.find_one(plot), area = view.canvas_view.events_el;
if (area.is_heard) { return; }
area.is_heard = true;
const snap = (v) => step.value > 0 ? Math.round(v / step.value) * step.value : v;
// On the screen: the view may move under a hand that is still.
const px = (one, other) => Math.hypot(one.sx - other.sx, one.sy - other.sy);
const place = (event) => {
  const {x_scale, y_scale, bbox} = view.frame, box = area.getBoundingClientRect();
  const sx = event.clientX - box.x, sy = event.clientY - box.y;
  return {sx, sy, x: x_scale.invert(sx), y: y_scale.invert(sy), is_inside: bbox.contains(sx, sy)};
};
// Seen on this page alone: the server is not told.
const draw = (model, values) => model.setv(values, {sync: false});
let begin = null, last = null, count = 0;
const clear = () => { begin = null; draw(preview, {data: {x: [], y: []}}); };
const follow = (to) => {
  const x = snap(to.x), y = snap(to.y);
  let text = `${x.toFixed(2)}, ${y.toFixed(2)} m`;
  if (begin !== null) {
    const x0 = snap(begin.x), y0 = snap(begin.y), kind = shapes[tool.labels[tool.active]];
    const dx = x - x0, dy = y - y0, length = Math.hypot(dx, dy);
    let xs = [x0, x], ys = [y0, y];
    if (kind === "box") { xs = [x0, x, x, x0, x0]; ys = [y0, y0, y, y, y0];
      text += `  ${Math.abs(dx).toFixed(2)} × ${Math.abs(dy).toFixed(2)} m`; }
    else { if (kind === "circle") { xs = []; ys = []; for (let i = 0; i <= 32; i++) {
        xs.push(x0 + length * Math.cos(i * Math.PI / 16));
        ys.push(y0 + length * Math.sin(i * Math.PI / 16)); } }
      text += `  ${length.toFixed(2)} m, ${(Math.atan2(dy, dx) * 180 / Math.PI).toFixed(0)}°`; }
    draw(preview, {data: {x: kind ? xs : [], y: kind ? ys : []}});
  }
  draw(label, {x: to.x, y: to.y, text, visible: true});
};
const listeners = {
  pointerdown: (event) => {
    const at = place(event);
    if (event.isPrimary && event.button === 0 && !pan.active && at.is_inside) { begin = at; }
  },
  pointermove: (event) => { if (event.isPrimary) { follow(place(event)); } },
  pointerup: (event) => {
    if (begin === null || !event.isPrimary) { return; }
    const end = place(event), is_click = px(begin, end) < click_px;
    const is_again = is_click && last !== null && px(last, begin) < again_px;
    const kind = is_again ? "again" : is_click ? "click" : "drag";
    gesture.data = {kind: [kind], x0: [begin.x], y0: [begin.y], x1: [end.x], y1: [end.y],
      count: [++count]};
    last = is_click ? begin : null;
    clear();
    follow(end);
  },
  pointercancel: clear,
  pointerleave: () => { if (begin === null) { draw(label, {visible: false}); } },
};
for (const [name, listener] of Object.entries(listeners)) { area.addEventListener(name, listener); }
