"use strict";
// Without this script every step is there to be read; with it, one at a time.
(() => {
  const players = new Map();

  function build(trial) {
    const steps = [...trial.querySelectorAll("ol.steps > li")];
    if (players.has(trial)) return players.get(trial);
    const player = { trial, steps, now: 0, isStepping: true };
    players.set(trial, player);
    if (!steps.length) return player;
    const bar = document.createElement("div");
    bar.className = "controls";
    const back = makeButton("\u2039", "One step back", () => show(player, player.now - 1));
    const on = makeButton("\u203a", "One step forward", () => show(player, player.now + 1));
    const slider = Object.assign(document.createElement("input"), { type: "range", min: 0, value: 0 });
    slider.max = steps.length - 1;
    slider.setAttribute("aria-label", "Step");
    slider.addEventListener("input", () => show(player, Number(slider.value)));
    const count = document.createElement("output");
    const all = makeButton("All steps", "Show all steps or one at a time", () => {
      player.isStepping = !player.isStepping;
      show(player, player.now);
    });
    bar.append(back, slider, on, count, all);
    trial.querySelector(".floor").append(bar);
    Object.assign(player, { slider, count, all });
    show(player, 0);
    return player;
  }

  function makeButton(label, title, act) {
    const button = Object.assign(document.createElement("button"), { type: "button", title });
    button.textContent = label;
    button.addEventListener("click", act);
    return button;
  }

  function show(player, index) {
    const { trial, steps } = player;
    player.now = Math.max(0, Math.min(steps.length - 1, index));
    trial.classList.toggle("stepping", player.isStepping);
    steps.forEach((step, each) => step.classList.toggle("now", each === player.now));
    player.slider.value = player.now;
    player.count.textContent = `${player.now + 1} of ${steps.length}`;
    player.all.textContent = player.isStepping ? "All steps" : "One step";
    move(trial, steps[player.now].dataset);
    if (!player.isStepping) steps[player.now].scrollIntoView({ block: "nearest" });
  }

  function move(trial, place) {
    const robot = trial.querySelector(".robot"), way = trial.querySelector(".so-far");
    if (robot && place.u !== undefined) {
      robot.setAttribute("transform", `translate(${place.u} ${place.v}) rotate(${place.heading})`);
    }
    if (way && place.driven !== undefined) way.setAttribute("stroke-dasharray", `${place.driven} 2`);
  }

  function follow() {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const trial = target && target.closest("details.trial");
    if (!trial) return;
    trial.open = true;
    const player = build(trial);
    if (player.steps.includes(target)) show(player, player.steps.indexOf(target));
    if (target === trial) trial.scrollIntoView();
  }

  document.addEventListener("toggle", (event) => {
    if (event.target.matches("details.trial") && event.target.open) build(event.target);
  }, true);
  document.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (by === undefined || event.target.closest("input, pre, .wide")) return;
    const open = event.target.closest("details.trial[open]") ?? document.querySelector("details.trial[open]");
    if (!open || !players.has(open) || !players.get(open).slider) return;
    event.preventDefault();
    show(players.get(open), players.get(open).now + by);
  });
  window.addEventListener("hashchange", follow);
  const trials = document.querySelectorAll("details.trial");
  if (trials.length === 1) trials[0].open = true;
  follow();
})();
