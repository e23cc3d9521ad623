const [x0, y0, x1, y1] = view.data.bounds, w = plot.inner_width, h = plot.inner_height;
if (w > 0 && h > 0) {
  const metre = Math.max((x1 - x0) / w, (y1 - y0) / h), x = (x0 + x1) / 2, y = (y0 + y1) / 2;
  plot.x_range.setv({start: x - metre * w / 2, end: x + metre * w / 2,
    reset_start: x - metre * w / 2, reset_end: x + metre * w / 2});
  plot.y_range.setv({start: y - metre * h / 2, end: y + metre * h / 2,
    reset_start: y - metre * h / 2, reset_end: y + metre * h / 2});
}
