// Plays the observed cloth and the predictions. Without it, the first frame stands still.
(() => {
  "use strict";
  const player = document.getElementById("motion");
  const recordings = JSON.parse(document.getElementById("motion-data").textContent);
  const control = (name) => player.querySelector(`[data-control="${name}"]`);
  const [play, choice, frame, turn, factor, speed] =
    ["play", "recording", "frame", "turn", "factor", "speed"].map(control);
  const { elevation, half, gap, head, filled, missing, reach: steps } = recordings.view;
  const stage = player.querySelector(".stage");
  const still = window.matchMedia("(prefers-reduced-motion: reduce)");
  let shown, playing = false, began = 0;

  const unpack = (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Int16Array.from({ length: bytes.length / 2 }, (_, i) => view.getInt16(2 * i, true));
  };

  function load() {
    const source = recordings.list[Number(choice.value)];
    shown = { ...source, observed: unpack(source.observed), errors: source.errors.map(unpack) };
    frame.max = String(source.frames - 1);
    frame.value = "0";
    turn.value = String(Math.round(source.azimuth * 180 / Math.PI));
    factor.value = String(source.factor);
    stage.innerHTML = source.still;
    began = performance.now();
    draw();
  }

  function wires(number, enlarged, centreX, centreY) {
    const angle = Number(turn.value) * Math.PI / 180;
    const [ca, sa, ce, se] = [Math.cos(angle), Math.sin(angle), Math.cos(elevation), Math.sin(elevation)];
    const scale = half * filled / shown.radius;
    const start = 3 * shown.markers * Number(frame.value);
    const places = [];
    for (let m = 0; m < shown.markers; m++) {
      const point = [0, 1, 2].map((axis) => {
        const at = start + 3 * m + axis;
        const seen = shown.observed[at];
        if (seen === missing) return NaN;
        if (number < 0) return seen / steps * shown.size;
        const error = shown.errors[number][at];
        return error === missing ? NaN : seen / steps * shown.size + enlarged * error / steps * shown.reach;
      });
      const away = -point[0] * sa + point[1] * ca;
      places.push([centreX + scale * (point[0] * ca + point[1] * sa), centreY - scale * (point[2] * ce + away * se)]);
    }
    let path = "";
    for (let e = 0; e < shown.edges.length; e += 2) {
      const [a, b] = [places[shown.edges[e]], places[shown.edges[e + 1]]];
      if (Number.isNaN(a[0] + a[1] + b[0] + b[1])) continue;
      path += `M${a[0].toFixed(1)} ${a[1].toFixed(1)}L${b[0].toFixed(1)} ${b[1].toFixed(1)}`;
    }
    return path;
  }

  function draw() {
    const meshes = stage.querySelectorAll("path.mesh");
    shown.errors.forEach((_, number) => {
      const x = half * (2 * number + 1) + gap * number;
      const y = shown.rise * half / shown.radius + head;
      meshes[2 * number].setAttribute("d", wires(-1, 0, x, y));
      meshes[2 * number + 1].setAttribute("d", wires(number, Number(factor.value), x, y));
    });
    frame.setAttribute("aria-valuetext", `${(Number(frame.value) / shown.rate).toFixed(2)} s`);
  }

  function step(now) {
    if (!playing) return;
    const due = Math.floor((now - began) / 1000 * shown.rate * Number(speed.value)) % shown.frames;
    if (due !== Number(frame.value)) {
      frame.value = String(due);
      draw();
    }
    requestAnimationFrame(step);
  }

  function run(on) {
    playing = on;
    play.textContent = on ? "Pause" : "Play";
    began = performance.now() - Number(frame.value) / shown.rate / Number(speed.value) * 1000;
    if (on) requestAnimationFrame(step);
  }

  play.addEventListener("click", () => run(!playing));
  choice.addEventListener("change", load);
  frame.addEventListener("input", () => { run(false); draw(); });
  speed.addEventListener("change", () => run(playing));
  turn.addEventListener("input", draw);
  factor.addEventListener("change", draw);
  still.addEventListener("change", () => { if (still.matches) run(false); });
  player.querySelector(".controls").hidden = false;
  load();
  run(!still.matches);
})();
