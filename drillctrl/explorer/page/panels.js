"use strict";
// Questions to the server, and the panels that show its answers.

const TOKEN = document.querySelector("meta[name=token]").content;

// Ask for a view. Lines say how far it is; the last one is the answer. Aborting ends the work.
async function ask(view, state, options, signal, heard) {
  const body = JSON.stringify({ view, state, options });
  if (body.length > 300000) throw new Error("That is more than is sent at once: leave out some of the rigs that were opened.");
  const response = await fetch("api/ask", {
    method: "POST", signal, body, headers: { "Content-Type": "application/json", "X-Token": TOKEN },
  });
  if (!response.ok) throw new Error(await response.text());
  const reader = response.body.getReader(), decoder = new TextDecoder();
  let text = "", answer = null;
  const read = line => {
    if (!line) return;
    const told = JSON.parse(line);
    if (told.words !== undefined) { if (heard) heard(told); } else answer = told;
  };
  for (;;) {
    const { done, value } = await reader.read();
    text += decoder.decode(value || new Uint8Array(), { stream: !done });
    const lines = text.split("\n");
    text = lines.pop();
    lines.forEach(read);
    if (done) break;
  }
  read(text);
  if (answer === null) throw new Error("drillctrl explore has ended, or the work was stopped.");
  if (answer.error !== undefined) throw new Error(answer.error);
  return answer.result;
}

function element(name, properties, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties || {})) {
    if (key === "class") made.className = value;
    else if (key.startsWith("aria-") || key === "role" || key === "for") made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...children.filter(child => child !== null && child !== undefined));
  return made;
}

const told = error => error instanceof TypeError ? "drillctrl explore does not answer: was it ended?" : error.message;

// A part of the page: picture, a sentence, command line and Python, downloads.
class Panel {
  constructor(id, title, extra) {
    this.id = id;
    this.picture = element("div", { class: "picture" });
    this.says = element("p", { class: "says" });
    this.state = element("span", { class: "state", role: "status", "aria-live": "off" });
    this.command = element("pre", { tabIndex: 0, "aria-label": `Command line of: ${title}` });
    this.python = element("pre", { tabIndex: 0, "aria-label": `Python of: ${title}` });
    this.savePicture = element("button", { type: "button", onclick: () => savePicture(`${id}.svg`, this.picture), disabled: true, "aria-label": `Download picture: ${title}` }, "Download picture");
    this.saveData = element("button", { type: "button", onclick: () => this.save(), disabled: true, "aria-label": `Download data: ${title}` }, "Download data");
    this.section = element("section", { class: "panel", id: `panel-${id}`, "aria-labelledby": `title-${id}` },
      element("div", { class: "head" }, element("h2", { id: `title-${id}` }, title), this.state),
      extra || null, this.says, this.picture, this.savePicture, this.saveData,
      element("details", {}, element("summary", {}, "Command line and Python"), this.command, this.python));
    document.getElementById("panels").append(this.section);
    this.columns = null;
    this.works = new Map();
  }
  // Who works for this panel says what; it is busy until the last of them has done.
  busy(words, who = this) {
    if (words) this.works.set(who, words); else this.works.delete(who);
    this.section.setAttribute("aria-busy", this.works.size ? "true" : "false");
    this.state.textContent = [...this.works.values()].pop() || "";
  }
  tell(text, wrong) {
    if (this.says.textContent !== text) this.says.textContent = text;
    this.says.classList.toggle("wrong", Boolean(wrong));
  }
  show(result, columns) {
    this.columns = columns;
    this.command.textContent = result.command || "";
    this.python.textContent = result.python || "";
    this.savePicture.disabled = !this.picture.querySelector("svg");
    this.saveData.disabled = !columns;
  }
  clear(text, wrong) {
    this.picture.replaceChildren();
    this.columns = null;
    this.savePicture.disabled = this.saveData.disabled = true;
    this.command.textContent = this.python.textContent = "";
    this.tell(text, wrong);
  }
  save() { saveText(`${this.id}.csv`, "text/csv", csv(this.columns)); }
}

// A panel that follows the hand: one question at a time, and then the newest.
class Follower {
  constructor(panel, view, options, draw) {
    Object.assign(this, { panel, view, options, draw, running: false, again: false, stop: null });
  }
  // What is shown is of another rig now, and so is what is being worked out.
  renew() {
    this.panel.clear("");
    if (this.stop) this.stop.abort();
  }
  // A job draws into this panel next: what was asked before it is not to come after.
  halt() {
    this.again = false;
    if (this.stop) this.stop.abort();
  }
  poke() {
    if (this.running) { this.again = true; return; }
    this.run();
  }
  async run() {
    this.running = true;
    const late = setTimeout(() => this.panel.busy("working …", this), 150);
    do {
      this.again = false;
      this.stop = new AbortController();
      const own = this.stop, began = performance.now();
      try {
        const result = await ask(this.view, question(), this.options(), own.signal);
        // Of a slow answer only the newest is worth drawing.
        if (!own.signal.aborted && (!this.again || performance.now() - began < 400)) this.draw(result);
      } catch (error) {
        if (!this.again && !own.signal.aborted) this.panel.clear(told(error), true);
      }
    } while (this.again);
    clearTimeout(late);
    this.panel.busy("", this);
    this.running = false;
  }
}

// Work that is started by hand: progress, and an end before its time.
class Job {
  constructor(panel, view, start, cancel, bar) {
    Object.assign(this, { panel, view, start, cancel, bar, stop: null });
    cancel.addEventListener("click", () => this.stop && this.stop.abort());
  }
  async run(options, draw) {
    if (this.stop) return;
    this.stop = new AbortController();
    this.start.disabled = true;
    this.cancel.hidden = this.bar.hidden = false;
    this.bar.removeAttribute("value");
    const began = performance.now();
    this.panel.busy("starting …");
    try {
      const result = await ask(this.view, question(), options, this.stop.signal, heard => {
        const spent = (performance.now() - began) / 1000;
        if (heard.total > 0) { this.bar.max = heard.total; this.bar.value = heard.done; }
        const left = heard.total > 0 && heard.done > 0 && spent > 1
          ? `, ${Math.ceil(spent / heard.done * (heard.total - heard.done))} s left` : "";
        this.panel.busy(heard.total > 0 ? `${heard.words}: ${short(heard.done)} of ${short(heard.total)}${left}` : `${heard.words} …`);
      });
      draw(result);
    } catch (error) {
      this.panel.tell(error.name === "AbortError" ? "Cancelled." : told(error), error.name !== "AbortError");
    }
    const focused = document.activeElement === this.cancel;
    this.cancel.hidden = this.bar.hidden = true;
    this.start.disabled = false;
    if (focused) this.start.focus();
    this.panel.busy("");
    this.stop = null;
  }
}

function jobControls(id, start, ...fields) {
  const go = element("button", { type: "button", id: `${id}-start` }, start);
  const cancel = element("button", { type: "button", id: `${id}-cancel`, hidden: true, "aria-label": `Cancel: ${start}` }, "Cancel");
  const bar = element("progress", { id: `${id}-progress`, hidden: true, "aria-label": start });
  return { go, cancel, bar, box: element("div", {}, element("div", { class: "controls" }, ...fields, go, cancel), bar) };
}

function field(id, text, properties, options) {
  const input = options
    ? element("select", { id, ...properties }, ...options.map(([value, label]) => element("option", { value }, label)))
    : element("input", { id, type: "number", ...properties });
  return { input, label: element("label", { for: id }, text, " ", input) };
}
