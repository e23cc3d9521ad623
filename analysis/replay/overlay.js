"use strict";
(function () {
  const data = JSON.parse(document.getElementById("navbench-data").textContent);
  const robots = data.robots;
  const find = (selector) => document.querySelector(selector);
  const legend = find("#navbench-legend"), dock = find("#navbench-dock"), player = find("#navbench-player");
  const strip = find("#navbench-strip");
  const animator = viewer.animator;
  const state = { chosen: 0, camera: "free" };
  const pathOf = (text) => text.split("/").filter(Boolean);
  const why = find("#navbench-why");
  // A small window, as one embedded in a page, shows the robot first.
  if (innerWidth < 700 || innerHeight < 600) legend.open = why.open = false;

  // ---- what is shown
  function show(path, isShown) { viewer.set_property(pathOf(path), "visible", isShown); }
  function applyLayers() {
    for (const box of legend.querySelectorAll("input[data-paths]")) {
      const paths = JSON.parse(box.dataset.paths);
      // Of some layers only the chosen robot's is shown: costmaps lie on one another.
      paths.forEach((path, index) => show(path, box.checked && (!box.dataset.ofChosen || index === state.chosen)));
    }
    viewer.set_dirty();
  }
  function applyRobots() {
    const how = find("#navbench-player .robots select").value;
    robots.forEach((robot, index) => {
      const lift = how === "apart" ? 1.2 * index : 0;
      viewer.set_transform(pathOf(robot.group), [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, lift, 1]);
      viewer.set_property(pathOf(robot.robot), "modulated_opacity", how === "ghosts" && index !== state.chosen ? 0.18 : 1);
    });
    viewer.set_dirty();
  }
  function choose(index) {
    state.chosen = index;
    legend.querySelectorAll(".choose").forEach((button, place) => button.setAttribute("aria-pressed", String(place === index)));
    const failure = find("#navbench-player .failure");
    failure.hidden = !robots[index].failed;
    applyLayers();
    applyRobots();
    drawStrip();
    told = undefined;
    tellWhy();
  }
  // ---- why the chosen one decides as it does, where the page was made with --why
  let told;
  function rowOf(kind, cells) {
    const row = document.createElement("tr");
    cells.forEach((text, place) => {
      const cell = row.appendChild(document.createElement(kind));
      cell.textContent = text;
      if (place && /[a-z]{3}/.test(text)) cell.className = "words";
    });
    return row;
  }
  function tellWhy() {
    const reasons = robots[state.chosen].reasons || [];
    why.hidden = !reasons.length;
    if (why.hidden) return;
    // The last cycle that began by now.
    let low = 0, high = reasons.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (reasons[middle].time <= animator.time + 1e-6) low = middle + 1; else high = middle;
    }
    const reason = reasons[Math.max(low - 1, 0)];
    if (reason === told) return;
    told = reason;
    why.querySelector("summary").textContent = `why, ${reason.time.toFixed(2)} s`;
    why.querySelector("p").textContent = reason.sentence;
    const rows = reason.rows.map((cells) => rowOf("td", cells));
    why.querySelector("table").replaceChildren(...(rows.length ? [rowOf("th", reason.columns), ...rows] : []));
    why.querySelector("div").textContent = reason.notes.join(" ");
  }
  legend.addEventListener("change", applyLayers);
  legend.querySelectorAll(".choose").forEach((button, index) => button.addEventListener("click", () => choose(index)));
  legend.querySelectorAll(".jump").forEach((button) => button.addEventListener("click", () => jump(Number(button.dataset.robot))));
  find("#navbench-player .robots select").addEventListener("change", applyRobots);
  find("#navbench-player .robots").hidden = robots.length < 2;

  // ---- cameras: three.js has y up and z towards the south
  const inView = (x, y, z) => [x, z, -y];
  function aim(position, target) {
    viewer.camera.position.set(...position);
    viewer.controls.target.set(...target);
    viewer.controls.update();
    viewer.set_dirty();
  }
  let free = null;
  function whereIs(robot) {
    const object = viewer.scene_tree.find(pathOf(robot.robot)).object;
    object.updateWorldMatrix(true, false);
    return object.getWorldPosition(viewer.camera.position.clone());
  }
  function setCamera(how) {
    // What somebody has turned and zoomed to is there again when the camera is free again.
    if (state.camera === "free") free = [viewer.camera.position.toArray(), viewer.controls.target.toArray()];
    state.camera = how;
    if (how === "free") aim(...free);
    if (how === "top") {
      const [x0, x1, y0, y1] = data.bounds, slope = Math.tan((viewer.camera.fov / 2) * Math.PI / 180);
      const distance = 0.55 * Math.max((x1 - x0) / viewer.camera.aspect, y1 - y0) / slope;
      const middle = [(x0 + x1) / 2, (y0 + y1) / 2];
      aim(inView(middle[0], middle[1] - 1e-3 * distance, distance), inView(...middle, 0));
    }
    if (how === "follow") {
      const place = whereIs(robots[state.chosen]).toArray();
      aim([place[0], place[1] + 4.5, place[2] + 4.5], place);
    }
  }
  function follow() {
    if (state.camera !== "follow") return;
    const step = whereIs(robots[state.chosen]).sub(viewer.controls.target);
    viewer.camera.position.add(step);
    viewer.controls.target.add(step);
  }
  // The scene is aimed for a window 1.5 times as wide as high; in a narrower one it steps back.
  function stepBack() {
    const factor = data.aspect / viewer.camera.aspect;
    if (factor <= 1) return;
    const target = viewer.controls.target;
    viewer.camera.position.sub(target).multiplyScalar(factor).add(target);
    viewer.controls.update();
    viewer.set_dirty();
  }
  find("#navbench-player .camera").addEventListener("change", (event) => setCamera(event.target.value));

  // ---- the strip of charts
  const SIGNALS = [["v", "v [m/s]"], ["w", "ω [rad/s]"], ["clearance", "clearance [m]"], ["compute", "compute [ms]"]];
  const LEFT = 132, RIGHT = 12;
  let background = null;
  const duration = () => animator.duration || Math.max(1, ...robots.map((robot) => robot.end));
  const across = (time) => LEFT + (strip.clientWidth - LEFT - RIGHT) * time / duration();
  function color(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }
  function drawStrip() {
    if (data.live) return;
    const ratio = devicePixelRatio || 1, width = strip.clientWidth, height = strip.clientHeight;
    if (!width || !height) return;
    strip.width = width * ratio;
    strip.height = height * ratio;
    background = document.createElement("canvas");
    background.width = strip.width;
    background.height = strip.height;
    const pen = background.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = "11px system-ui, sans-serif";
    pen.textBaseline = "middle";
    const each = height / SIGNALS.length;
    SIGNALS.forEach(([key, label], row) => {
      const values = robots.flatMap((robot) => robot[key].filter((value) => value !== null));
      const low = Math.min(0, ...values), highest = Math.max(low + 1e-3, ...values);
      // Beyond the axis of compute times a peak is cut off, and told as a number.
      const high = key === "compute" && data.compute_top_ms ? Math.max(low + 1e-3, data.compute_top_ms) : highest;
      const top = row * each + 4, room = each - 8;
      const down = (value) => top + room * (high - Math.min(value, high)) / (high - low);
      pen.strokeStyle = color("--nb-line");
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(LEFT, down(0));
      pen.lineTo(width - RIGHT, down(0));
      pen.stroke();
      pen.fillStyle = color("--nb-ink");
      pen.textAlign = "left";
      pen.fillText(label, 12, row * each + each / 2);
      pen.fillStyle = color("--nb-muted");
      pen.textAlign = "right";
      pen.fillText(values.length ? String(Number(high.toPrecision(2))) : "–", LEFT - 5, top + 5);
      // Below the label, which it would reach into otherwise.
      if (highest > high && each >= 30) pen.fillText(`peak ${Number(highest.toPrecision(2))}`, LEFT - 5, row * each + each - 6);
      // The chosen one last, above the others.
      const order = robots.map((_, index) => index).sort((a, b) => (a === state.chosen) - (b === state.chosen));
      for (const index of order) {
        const robot = robots[index];
        pen.globalAlpha = index === state.chosen ? 1 : 0.4;
        pen.strokeStyle = robot.color;
        pen.lineWidth = index === state.chosen ? 1.6 : 1;
        pen.beginPath();
        let isDown = false;
        robot.time.forEach((time, place) => {
          const value = robot[key][place];
          if (value === null) { isDown = false; return; }
          pen[isDown ? "lineTo" : "moveTo"](across(time), down(value));
          isDown = true;
        });
        pen.stroke();
      }
      pen.globalAlpha = 1;
    });
    drawCursor();
  }
  function drawCursor() {
    if (!background) return;
    const pen = strip.getContext("2d"), ratio = devicePixelRatio || 1, robot = robots[state.chosen];
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, strip.width, strip.height);
    pen.drawImage(background, 0, 0);
    pen.scale(ratio, ratio);
    const x = across(animator.time), each = strip.clientHeight / SIGNALS.length;
    pen.strokeStyle = color("--nb-bad");
    pen.beginPath();
    pen.moveTo(x, 0);
    pen.lineTo(x, strip.clientHeight);
    pen.stroke();
    let place = robot.time.findIndex((time) => time > animator.time) - 1;
    if (place < 0) place = animator.time > 0 ? robot.time.length - 1 : 0;
    pen.font = "600 11px system-ui, sans-serif";
    pen.textBaseline = "middle";
    pen.fillStyle = color("--nb-ink");
    const isLeft = x > strip.clientWidth - 70;
    pen.textAlign = isLeft ? "right" : "left";
    SIGNALS.forEach(([key], row) => {
      const value = robot[key][place];
      if (value !== null && value !== undefined) pen.fillText(value.toFixed(2), x + (isLeft ? -5 : 5), row * each + each / 2);
    });
  }
  function seekTo(event) {
    const box = strip.getBoundingClientRect();
    const share = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
    seek(Math.max(0, Math.min(1, share)) * duration());
  }
  strip.addEventListener("pointerdown", (event) => { strip.setPointerCapture(event.pointerId); seekTo(event); });
  strip.addEventListener("pointermove", (event) => { if (event.buttons) seekTo(event); });

  // ---- the names of floors, above the scene
  const labels = (data.floors || []).map((floor) => {
    const label = document.createElement("div");
    label.className = "navbench-floor";
    label.textContent = floor.name;
    document.body.append(label);
    return [label, floor];
  });
  function placeLabels() {
    const pane = find("#meshcat-pane").getBoundingClientRect();
    for (const [label, floor] of labels) {
      const place = viewer.camera.position.clone().set(...inView(floor.x, floor.y, 0)).project(viewer.camera);
      label.hidden = place.z > 1;
      label.style.left = `${pane.left + (place.x + 1) / 2 * pane.width}px`;
      label.style.top = `${pane.top + (1 - place.y) / 2 * pane.height}px`;
    }
  }

  // ---- the player
  const button = player.querySelector(".play"), slider = player.querySelector("input"), clock = player.querySelector("output");
  let start = /^#t=([0-9.]+)$/.exec(location.hash);
  function seek(time) {
    animator.pause();
    animator.time = Math.min(time, animator.duration);
    animator.seek(animator.time);
  }
  function jump(index) {
    choose(index);
    // A moment before, so that what comes is seen coming.
    seek(Math.max(0, robots[index].end - 1));
  }
  function toggle() {
    if (animator.playing) {
      animator.pause();
    } else {
      if (animator.time >= animator.duration) { animator.reset(); }
      animator.play();
    }
  }
  button.addEventListener("click", toggle);
  slider.addEventListener("input", () => seek(Number(slider.value)));
  player.querySelector(".speed").addEventListener("change", (event) => { animator.mixer.timeScale = Number(event.target.value); });
  player.querySelector(".failure").addEventListener("click", () => jump(state.chosen));
  // The space bar plays, whatever has the focus; before anything else takes it.
  addEventListener("keydown", (event) => {
    if (event.code === "Space") {
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) toggle();
    } else if (event.code === "KeyF" && robots[state.chosen].failed) {
      jump(state.chosen);
    }
  }, true);
  addEventListener("keyup", (event) => { if (event.code === "Space") event.preventDefault(); }, true);

  function fit() {
    document.documentElement.style.setProperty("--nb-dock", `${dock.offsetHeight}px`);
    viewer.set_3d_pane_size();
    drawStrip();
  }
  addEventListener("resize", fit);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawStrip);
  let drawnTime = null, drawnDuration = null;
  // A link that ends in #t=SECONDS opens the page at that moment.
  function everyFrame() {
    if (start && animator.duration > 0) {
      seek(Number(start[1]));
      start = null;
    }
    if (animator.duration !== drawnDuration) {
      if (animator.duration > 0) stepBack();
      drawnDuration = animator.duration;
      drawStrip();
    }
    if (animator.time !== drawnTime) {
      drawnTime = animator.time;
      follow();
      drawCursor();
      tellWhy();
    }
    placeLabels();
    slider.max = animator.duration || 1;
    slider.value = animator.time;
    button.textContent = animator.playing ? "Pause" : "Play";
    clock.textContent = `${animator.time.toFixed(1)} / ${(animator.duration || 0).toFixed(1)} s`;
    requestAnimationFrame(everyFrame);
  }
  // A trial that runs: the scene comes from Meshcat's server, and there is no time to go back to.
  function watchLive() {
    strip.hidden = true;
    for (const part of [button, slider, clock, player.querySelector(".speed").parentElement]) part.hidden = true;
    const socket = new WebSocket(data.live);
    socket.binaryType = "arraybuffer";
    socket.onmessage = (message) => { handle_message(message); viewer.set_dirty(); };
    viewer.connection = socket;
    if (data.controls) {
      // Buttons and sliders of the trial stand in Meshcat's panel, below the tree of the scene.
      document.body.classList.add("navbench-controls");
      viewer.gui.width = Math.min(460, innerWidth);
      for (const folder of Object.values(viewer.gui.__folders)) folder.close();
      viewer.gui.open();
    }
    const again = async () => {
      const answer = await fetch("/number").catch(() => null);
      const number = answer && (await answer.text());
      if (number && data.number && number !== data.number) location.reload();
      data.number = number || data.number;
      setTimeout(again, 500);
    };
    again();
    find("#navbench-player .camera").value = "follow";
    setTimeout(() => setCamera("follow"), 500);
    const everyLook = () => { follow(); requestAnimationFrame(everyLook); };
    everyLook();
  }

  if (data.live) {
    watchLive();
    fit();
    applyLayers();
  } else {
    fit();
    choose(0);
    everyFrame();
  }
})();
