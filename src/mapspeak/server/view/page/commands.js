// A person's commands. To stop and to hold need no key; everything else does.
// @ts-check

const find = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));
const KEPT = "mapspeak-key";

export class Commands {
  /** @param {string} base address of the robot */
  constructor(base) {
    this.base = base;
    this.key = sessionStorage.getItem(KEPT) ?? "";
    this.waiting = "";
    this.showLock();
    find("stop").addEventListener("click", () => this.send("stop"));
    find("hold").addEventListener("click", () => this.send("hold"));
    find("release").addEventListener("click", () => this.send("release"));
    find("unlock").addEventListener("submit", (/** @type {Event} */ event) => {
      event.preventDefault();
      this.unlock(find("token").value);
    });
    document.addEventListener("keydown", (event) => {
      const isTyping = event.target instanceof HTMLInputElement && event.target.type !== "checkbox";
      if (event.key === "s" && !isTyping && !event.ctrlKey && !event.metaKey) this.send("stop");
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
      const answer = await fetch(`${this.base}/${command}`, {
        method: "POST",
        headers: { "content-type": "application/json", "x-mapspeak-key": this.key },
        body: JSON.stringify(body),
      });
      said = await answer.text();
      if (answer.status === 403 && this.key) this.keep("");
    } catch {
      said = command === "stop" || command === "hold"
        ? "NOT SENT: the server does not answer. Press the robot's own stop button."
        : "Not sent: the server does not answer.";
    }
    this.say(said);
    return said;
  }

  /** @param {string} token */
  async unlock(token) {
    const answer = await fetch("unlock", {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify({ token }),
    });
    find("token").value = "";
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
    this.showLock();
  }

  showLock() {
    document.body.classList.toggle("unlocked", this.key !== "");
  }

  /** @param {string} text */
  say(text) {
    const said = find("said");
    said.textContent = text;
    said.hidden = false;
  }

  /** @param {Record<string, string>} waiting what waits for a person's word, by its id */
  showWaiting(waiting) {
    const shown = JSON.stringify(waiting);
    if (shown === this.waiting) return;
    this.waiting = shown;
    const rows = Object.entries(waiting).map(([id, what]) => {
      const row = document.createElement("div");
      const text = document.createElement("span");
      text.textContent = `May it ${what}?`;
      row.append(text, this.button("Approve", "approve", { id }), this.button("Refuse", "refuse", { id }));
      return row;
    });
    find("waiting").replaceChildren(...rows);
    find("waiting").hidden = rows.length === 0;
  }

  /**
   * @param {string} label
   * @param {string} command
   * @param {object} body
   */
  button(label, command, body) {
    const button = document.createElement("button");
    button.textContent = label;
    if (command !== "check") button.className = "locked";
    button.addEventListener("click", () => this.send(command, body));
    return button;
  }
}
