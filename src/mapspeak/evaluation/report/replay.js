"use strict";
// Without this script every step is there to be read; with it, one at a time.
(() => {
  const steps = [...document.querySelectorAll("ol.steps > li")];
  if (!steps.length) return;
  const robot = document.querySelector(".robot");
  const make = (tag, fields) => Object.assign(document.createElement(tag), fields);
  const count = make("output"), slider = make("input", { type: "range", min: 0, max: steps.length - 1 });
  let now = 0, isStepping = true;

  function show(index) {
    now = Math.max(0, Math.min(steps.length - 1, index));
    document.body.classList.toggle("stepping", isStepping);
    steps.forEach((step, each) => step.classList.toggle("now", each === now));
    slider.value = now;
    count.textContent = `${now + 1} of ${steps.length}`;
    all.textContent = isStepping ? "All steps" : "One step";
    const place = steps[now].dataset;
    if (robot && place.u !== undefined) {
      robot.setAttribute("transform", `translate(${place.u} ${place.v}) rotate(${place.heading})`);
    }
    if (!isStepping) steps[now].scrollIntoView({ block: "nearest" });
  }

  function makeButton(label, title, act) {
    const button = make("button", { type: "button", title, textContent: label });
    button.addEventListener("click", act);
    return button;
  }

  function follow() {
    const index = steps.findIndex((step) => `#${step.id}` === location.hash);
    show(index < 0 ? now : index);
  }

  const back = makeButton("\u2039", "One step back", () => show(now - 1));
  const on = makeButton("\u203a", "One step forward", () => show(now + 1));
  const all = makeButton("All steps", "Show all steps or one at a time", () => {
    isStepping = !isStepping;
    show(now);
  });
  slider.setAttribute("aria-label", "Step");
  slider.addEventListener("input", () => show(Number(slider.value)));
  const bar = make("div", { className: "controls" });
  bar.append(back, slider, on, count, all);
  document.querySelector(".floor").append(bar);
  document.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (by === undefined || event.target.closest("input, pre, .wide")) return;
    event.preventDefault();
    show(now + by);
  });
  window.addEventListener("hashchange", follow);
  follow();
})();
