// The calls of tools, as their client was answered.
// @ts-check

const MOST = 100;

/**
 * @typedef {{number: number, tool: string, arguments: object, is_over: boolean, is_error: boolean,
 *   text: string, n_pictures: number}} Call
 */

export class Calls {
  /**
   * @param {HTMLElement} list
   * @param {HTMLElement} count
   * @param {string} base address of the robot
   */
  constructor(list, count, base) {
    this.list = list;
    this.count = count;
    this.base = base;
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
      this.list.prepend(row);
    }
    const details = /** @type {HTMLDetailsElement} */ (row.firstChild);
    details.className = call.is_over ? (call.is_error ? "failed" : "") : "running";
    details.replaceChildren(this.summary(call));
    const fill = () => {
      if (details.open && details.childElementCount === 1) details.append(...this.answer(call));
    };
    details.ontoggle = fill;
    fill();
    this.count.textContent = String(call.number);
    for (const number of [...this.rows.keys()].sort((a, b) => a - b).slice(0, -MOST)) {
      this.rows.get(number)?.remove();
      this.rows.delete(number);
    }
  }

  /** @param {Call} call */
  summary(call) {
    const summary = document.createElement("summary");
    const told = document.createElement("code");
    told.textContent = Object.entries(call.arguments)
      .map(([name, value]) => `${name}=${JSON.stringify(value)}`).join(", ");
    const state = call.is_over ? (call.is_error ? " failed" : "") : " …";
    summary.append(`${call.number} ${call.tool} `, told, state);
    return summary;
  }

  /** @param {Call} call */
  answer(call) {
    const text = document.createElement("pre");
    text.textContent = call.text;
    const pictures = Array.from({ length: call.n_pictures }, (_, index) => {
      const picture = new Image();
      picture.src = `${this.base}/calls/${call.number}/${index}`;
      picture.alt = `Picture ${index + 1} of ${call.n_pictures} that ${call.tool} answered with`;
      return picture;
    });
    return [text, ...pictures];
  }
}
