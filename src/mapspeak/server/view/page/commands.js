// A person's commands. To stop and to hold need no key; everything else does.
// @ts-check
"use strict";

const KEPT = "mapspeak-key";
const SAID_S = 20;
const FREE = ["stop", "stop-all", "hold", "check"];

class Commands {
  /**
   * @param {string} base address of the robot
   * @param {{robot: string, isFleet: boolean}} served
   */
  constructor(base, { robot, isFleet }) {
    this.base = base;
    this.waiting = "";
    this.asked = "";
    this.fading = 0;
    this.page = Math.random().toString(36).slice(2);
    // A key that `mapspeak view` gave stands behind the #, which no server is sent.
    const given = new URLSearchParams(location.hash.slice(1)).get("key");
    if (given) history.replaceState(null, "", location.pathname + location.search);
    this.key = "";
    this.keep(given ?? sessionStorage.getItem(KEPT) ?? "");
    if (isFleet) byId("stop").textContent = `STOP ${robot}`;
    byId("stop").addEventListener("click", () => this.send("stop"));
    byId("stop-all").addEventListener("click", () => this.send("stop-all"));
    byId("hold").addEventListener("click", () => this.send("hold"));
    byId("release").addEventListener("click", () => this.send("release"));
    byId("unlock").addEventListener("submit", (/** @type {Event} */ event) => {
      event.preventDefault();
      this.unlock(byId("token").value, byId("name").value);
    });
    document.addEventListener("keydown", (event) => {
      const isTyping = event.target instanceof HTMLInputElement && event.target.type !== "checkbox";
      if (event.key !== "s" || isTyping || event.ctrlKey || event.metaKey) return;
      this.send(isFleet ? "stop-all" : "stop");
    });
  }

  /**
   * @param {string} command
   * @param {object} [body]
   * @returns {Promise<string>} what came of it
   */
  async send(command, body = {}) {
    let said;
    try {
      const answer = await fetch(command === "stop-all" ? command : `${this.base}/${command}`, {
        method: "POST",
        headers: { "content-type": "application/json", "x-mapspeak-key": this.key,
          "x-mapspeak-page": this.page },
        body: JSON.stringify(body),
      });
      said = await answer.text();
      if (answer.status === 403 && this.key) this.keep("");
    } catch {
      said = ["stop", "stop-all", "hold"].includes(command)
        ? "NOT SENT: the server does not answer. Press the robot's own stop button."
        : "Not sent: the server does not answer.";
    }
    this.say(said);
    return said;
  }

  /** @param {string} token @param {string} name */
  async unlock(token, name) {
    const answer = await fetch("unlock", {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify({ token, name }),
    });
    byId("token").value = "";
    if (answer.ok) {
      this.keep((await answer.json()).key);
      this.say("Unlocked.");
    } else {
      this.say(await answer.text());
    }
  }

  /** @param {string} key */
  keep(key) {
    this.key = key;
    sessionStorage.setItem(KEPT, key);
    document.body.classList.toggle("unlocked", key !== "");
  }

  /** Show what a person has done at another page. @param {{said: string, page: string}} word */
  hear({ said, page }) {
    if (page !== this.page) this.say(said);
  }

  /** @param {string} text */
  say(text) {
    const said = byId("said");
    said.textContent = legible(text);
    said.hidden = false;
    window.clearTimeout(this.fading);
    // What went wrong stays until something else is said.
    if (!/NOT |not /.test(text)) this.fading = window.setTimeout(() => { said.hidden = true; }, 1000 * SAID_S);
  }

  /** @param {Record<string, string>} waiting what waits for a person's word, by its id */
  showWaiting(waiting) {
    const shown = JSON.stringify(waiting);
    if (shown === this.waiting) return;
    this.waiting = shown;
    const rows = Object.entries(waiting).map(([id, what]) => {
      const row = document.createElement("div");
      row.append(plain(`May it ${what}?`), this.button("Approve", "approve", { id }),
        this.button("Refuse", "refuse", { id }));
      return row;
    });
    byId("waiting").replaceChildren(...rows);
    byId("waiting").hidden = rows.length === 0;
  }

  /** Ask a person what a mission asks, with its picture.
   * @param {{id: string, said: string, answers: string[], picture: string}[]} questions */
  showQuestions(questions) {
    const ids = questions.map(({ id }) => id).join();
    if (ids === this.asked) return;
    this.asked = ids;
    byId("asked").replaceChildren(...questions.map(({ id, said, answers, picture }) => {
      const row = document.createElement("div");
      if (picture) row.append(showPicture(`${this.base}/${picture}`, `What ${id} is about`));
      row.append(plain(said), ...answers.map((answer) => this.button(answer, "answer", { question: id, answer })));
      if (!answers.length) row.append(this.form(`Answer ${id}`, "answer", (answer) => ({ question: id, answer }), "an answer"));
      return row;
    }));
    byId("asked").hidden = questions.length === 0;
  }

  /**
   * Return what a person may do where the map was clicked.
   * @param {Click} click
   * @param {() => void} close
   */
  offer({ x, y, item }, close) {
    const offered = document.createElement("div");
    const target = { x, y };
    const id = item?.id ?? "";
    offered.append(plain(item?.said ?? `x ${x}, y ${y}`), plain("Locked: type your token above to command."));
    offered.children[1].className = "locked-note";
    offered.append(this.button("Check this goal", "check", target), this.button("Drive here", "drive", target));
    if (item?.kind === "room" || item?.kind === "door") {
      offered.append(this.form(`Close ${id} until`, "close", (until) => ({ place: id, until }), "14:00 or in 2h"));
    }
    if (item?.kind === "closed" && id) offered.append(this.button(`End ${id}`, "end", { event: id }));
    if (item?.kind === "place") {
      offered.append(this.form("Rename to", "rename", (name) => ({ place: id, name }), item.name ?? ""));
    }
    if (item?.kind === "place" || item?.kind === "thing") {
      offered.append(this.button(`Forget ${id}`, "forget", { what: id }));
    }
    offered.append(this.form("Note this place as", "note", (name) => ({ ...target, name }), "a name"));
    for (const form of offered.querySelectorAll("form")) form.addEventListener("submit", close);
    for (const button of offered.querySelectorAll(":scope > button")) button.addEventListener("click", close);
    return offered;
  }

  /**
   * @param {string} label
   * @param {string} command
   * @param {object} body
   */
  button(label, command, body) {
    const button = document.createElement("button");
    button.textContent = legible(label);
    if (!FREE.includes(command)) button.className = "locked";
    button.addEventListener("click", () => this.send(command, body));
    return button;
  }

  /**
   * Return a command with a line of text.
   * @param {string} label
   * @param {string} command
   * @param {(typed: string) => object} body
   * @param {string} hint
   */
  form(label, command, body, hint) {
    const [form, typed, button] = ["form", "input", "button"].map((name) => document.createElement(name));
    const line = /** @type {HTMLInputElement} */ (typed);
    Object.assign(line, { placeholder: hint, maxLength: 120 });
    line.setAttribute("aria-label", label);
    button.textContent = label;
    form.className = "locked";
    form.append(button, line);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.send(command, body(line.value.trim()));
    });
    return form;
  }
}
