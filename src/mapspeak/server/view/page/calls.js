// What was said: calls of tools, as their client was answered, and in a replay all else too.
// @ts-check
"use strict";

const MOST_CALLS = 100;

/**
 * @typedef {{number: number, tool: string, arguments: object, is_over: boolean, is_error: boolean,
 *   text: string, pictures: string[], note?: string, age_s?: number | null, took_s?: number | null}} Call
 */

class Calls {
  /**
   * @param {HTMLElement} list
   * @param {{address?: (picture: string) => string, isNewestFirst?: boolean, most?: number}} options
   */
  constructor(list, { address = (picture) => picture, isNewestFirst = true, most = MOST_CALLS } = {}) {
    this.list = list;
    this.address = address;
    this.isNewestFirst = isNewestFirst;
    this.most = most;
    /** @type {Map<number, HTMLLIElement>} */
    this.rows = new Map();
  }

  /** @param {Call[]} calls */
  showAll(calls) {
    this.rows.clear();
    this.list.replaceChildren();
    for (const call of calls) this.show(call);
  }

  /** @param {Call} call */
  show(call) {
    let row = this.rows.get(call.number);
    if (!row) {
      row = document.createElement("li");
      row.append(document.createElement("details"));
      this.rows.set(call.number, row);
      if (this.isNewestFirst) this.list.prepend(row); else this.list.append(row);
    }
    const details = /** @type {HTMLDetailsElement} */ (row.firstChild);
    details.className = call.is_over ? (call.is_error ? "failed" : "") : "running";
    details.replaceChildren(this.summary(call));
    const fill = () => {
      if (details.open && details.childElementCount === 1) details.append(...this.answer(call));
    };
    details.ontoggle = fill;
    fill();
    for (const number of [...this.rows.keys()].sort((a, b) => a - b).slice(0, -this.most)) {
      this.rows.get(number)?.remove();
      this.rows.delete(number);
    }
  }

  /** Let the times since each call go on. */
  showAges() {
    for (const note of this.list.querySelectorAll(".age")) showAge(/** @type {HTMLElement} */ (note));
  }

  /** @param {Call} call */
  summary(call) {
    const summary = document.createElement("summary");
    const told = document.createElement("code");
    told.textContent = legible(Object.entries(call.arguments)
      .map(([name, value]) => `${name}=${JSON.stringify(value)}`).join(", "));
    const state = call.is_over ? (call.is_error ? " failed" : "") : " …";
    const note = document.createElement("small");
    note.textContent = legible(call.note ?? "");
    if (call.age_s != null) {
      note.className = "age";
      note.dataset.begun = String(performance.now() - 1000 * call.age_s);
      note.dataset.took = call.took_s == null ? "" : `, took ${call.took_s} s`;
      showAge(note);
    }
    summary.append(legible(`${call.number} ${call.tool} `), told, state, " ", note);
    return summary;
  }

  /** @param {Call} call */
  answer(call) {
    const text = document.createElement("pre");
    text.textContent = legible(call.text);
    text.dir = "auto";
    const n_pictures = call.pictures.length;
    const pictures = call.pictures.map((name, index) =>
      showPicture(this.address(name), `Picture ${index + 1} of ${n_pictures} of ${call.number} ${call.tool}`));
    return call.text ? [text, ...pictures] : pictures;
  }
}

/** @param {HTMLElement} note */
function showAge(note) {
  note.textContent = ago((performance.now() - Number(note.dataset.begun)) / 1000) + note.dataset.took;
}

/** Return a picture that leads to itself in full size. @param {string} address @param {string} alt */
function showPicture(address, alt) {
  const picture = new Image();
  picture.src = address;
  picture.alt = alt;
  picture.loading = "lazy";
  if (address.startsWith("data:")) return picture;
  const link = document.createElement("a");
  link.href = address;
  link.target = "_blank";
  link.append(picture);
  return link;
}
