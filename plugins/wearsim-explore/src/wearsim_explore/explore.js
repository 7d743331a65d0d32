"use strict";
// The page sends JSON in the property `request` of the model "exchange", and shows what comes in `reply`.
(() => {
  const el = name => document.getElementById(name);
  const places = 1000;  // of a slider
  let state = {figures: []}, fields = [], exchange = null, count = 0, playing = 0, ended = false, waiting = null, missed = false;

  const send = content => {
    if (ended || !exchange) return;
    exchange.request = JSON.stringify({...content, count: count += 1, frame: +el("frame").value || 0});
  };

  // values of sliders ------------------------------------------------------------------------------------------

  const rounded = (value, slider) => slider.step ? Math.round(value / slider.step) * slider.step : +value.toPrecision(4);
  const value_at = (place, slider) => {
    const part = place / places;
    const value = slider.log ? slider.low * (slider.high / slider.low) ** part : slider.low + part * (slider.high - slider.low);
    return rounded(value, slider);
  };
  const place_of = (value, slider) => Math.round(places * (slider.log
    ? Math.log(Math.max(value, slider.low) / slider.low) / Math.log(slider.high / slider.low)
    : (value - slider.low) / (slider.high - slider.low)));

  // at most one change of a slider is sent in a frame of the screen
  const change = (key, value, begins, held) => {
    if (waiting && waiting.key !== key) flush();
    if (waiting) { Object.assign(waiting, {value, held, begins: waiting.begins || begins}); return; }
    waiting = {key, value, begins, held, slides: true};
    requestAnimationFrame(flush);
  };
  const flush = () => { if (waiting) send({do: "change", ...waiting}); waiting = null; };

  // fields -----------------------------------------------------------------------------------------------------

  const make = (tag, properties = {}, ...children) => {
    const node = Object.assign(document.createElement(tag), properties);
    node.append(...children);
    return node;
  };

  const field_node = (field, number) => {
    const name = `value${number}`, node = make("div", {className: "field"});
    node.dataset.key = field.key;
    const label = make("label", {htmlFor: name}, field.label);
    if (field.unit) label.append(" ", make("span", {className: "unit"}, `[${field.unit}]`));
    const mistake = make("p", {className: "mistake", id: `${name}-mistake`});
    const describe = make("p", {className: "description", id: `${name}-text`, hidden: true}, field.description);
    let input;
    if (field.kind === "choice" || field.kind === "flag") {
      input = make("select", {id: name});
      if (field.value === null) input.append(make("option", {value: ""}, field.default ? `(${field.default})` : "(none)"));
      for (const choice of field.choices) input.append(make("option", {value: choice}, choice));
      if (field.value !== null && !field.choices.includes(field.value)) input.append(make("option", {value: field.value}, field.value));
      input.value = field.value ?? "";
      input.addEventListener("change", () => send({do: "change", key: field.key, value: input.value, begins: true}));
    } else {
      input = make("input", {id: name, type: "text", value: field.value ?? "", placeholder: field.default, autocomplete: "off", spellcheck: false});
      if (field.kind === "file") input.setAttribute("list", "files");
      if (field.kind !== "text" && field.kind !== "file") input.inputMode = "decimal";
      input.addEventListener("change", () => { show_on_slider(node, field); send({do: "change", key: field.key, value: input.value, begins: true}); });
    }
    input.setAttribute("aria-describedby", `${mistake.id} ${describe.id}`);
    if (field.kind === "text" || field.kind === "file") node.classList.add("wide");
    node.append(label, input);
    if (field.slider) {
      const range = make("input", {type: "range", min: 0, max: places, step: 1});
      range.setAttribute("aria-label", `${field.table} ${field.label}, slider`);
      let begins = true, held = false;
      range.addEventListener("pointerdown", () => { held = true; });
      range.addEventListener("change", () => { if (held) { held = false; flush(); send({do: "release"}); } });
      for (const event of ["pointerdown", "focus"]) range.addEventListener(event, () => { begins = true; });
      range.addEventListener("input", () => {
        const value = value_at(+range.value, field.slider);
        input.value = String(value);
        range.setAttribute("aria-valuetext", `${value} ${field.unit}`.trim());
        change(field.key, input.value, begins, held);
        begins = false;
      });
      node.append(range);
    }
    node.append(mistake, describe);
    show_on_slider(node, field);
    return node;
  };

  const show_on_slider = (node, field) => {
    const range = node.querySelector("input[type=range]"), value = parseFloat(node.querySelector("input[type=text]")?.value);
    if (!range) return;
    const shown = Number.isFinite(value) ? value : parseFloat(field.default);
    range.value = Number.isFinite(shown) ? place_of(shown, field.slider) : places / 2;
    range.setAttribute("aria-valuetext", Number.isFinite(shown) ? `${shown} ${field.unit}`.trim() : "no value");
  };

  const show_fields = () => {
    const focused = document.activeElement?.closest?.(".field")?.dataset.key;
    const was_range = document.activeElement?.type === "range";
    const groups = new Map();
    fields.forEach((field, number) => {
      if (!groups.has(field.table)) groups.set(field.table, make("fieldset", {}, make("legend", {}, field.table ? `[${field.table}]` : "scenario")));
      groups.get(field.table).append(field_node(field, number));
    });
    el("fields").replaceChildren(...groups.values());
    if (focused) for (const node of document.querySelectorAll(".field")) if (node.dataset.key === focused)
      node.querySelector(was_range ? "input[type=range]" : "input, select")?.focus();
    filter();
  };

  const filter = () => {
    const words = el("search").value.toLowerCase().split(/\s+/).filter(Boolean);
    let hidden = 0;
    const changed = JSON.parse(state.link ?? "{}");
    for (const field of fields) {
      const node = node_of(field.key);
      const text = `${field.key} ${field.key.replaceAll("_", " ")} ${field.description}`.toLowerCase();
      const shown = words.length ? words.every(word => text.includes(word))
        : field.value !== null || field.key in changed || field.key in (state.mistakes ?? {});
      node.hidden = !shown;
      node.style.display = shown ? "" : "none";
      node.querySelector(".description").hidden = !words.length;
      node.classList.toggle("changed", field.key in changed);
      hidden += !shown;
    }
    for (const group of document.querySelectorAll("fieldset"))
      group.hidden = [...group.querySelectorAll(".field")].every(node => node.hidden);
    el("hidden").textContent = hidden ? `${hidden} more keys are found by their name.` : "";
  };
  const node_of = key => document.querySelector(`.field[data-key="${CSS.escape(key)}"]`);

  // what comes from the server ---------------------------------------------------------------------------------

  const STAGES = {first: "first answer, tolerance 0.1; refined at rest", final: "refined to the tolerance of the scenario", lives: "refined to the tolerance of the scenario", failed: "mistakes: the last good result is shown in grey"};

  const rows_into = (node, rows) => node.replaceChildren(...rows.flatMap(([label, text]) => [make("dt", {}, label), make("dd", {}, text)]));

  window.wearsim_receive = text => {
    if (!text) return;
    state = JSON.parse(text);
    // fields of an older state than the one that was last sent would undo what is being typed
    const current = state.seen === count && !waiting;
    if (state.fields && !current) missed = true;
    else if (missed && current && !state.fields) { missed = false; send({do: "show"}); }
    if (state.fields && current) {
      missed = false;
      fields = state.fields;
      el("files")?.remove();
      document.body.append(make("datalist", {id: "files"}, ...state.files.map(value => make("option", {value}))));
      show_fields();
    }
    for (const node of document.querySelectorAll(".field")) {
      const mistake = state.mistakes[node.dataset.key] ?? "", shown = node.querySelector(".mistake");
      if (shown.textContent !== mistake) shown.textContent = mistake;
      node.querySelector("input[type=text], select").toggleAttribute("aria-invalid", Boolean(mistake));
    }
    filter();
    const failed = Object.keys(state.mistakes).length + state.others.length > 0;
    el("shown").classList.toggle("stale", failed);
    el("others").hidden = !state.others.length;
    if (el("others").textContent !== state.others.join("\n")) el("others").textContent = state.others.join("\n");
    if (!ended) el("status").textContent = failed ? STAGES.failed : state.test ? STAGES[state.stage] ?? "computing" : "computing";
    el("status").dataset.stage = failed ? "failed" : state.test ? state.stage : "";
    el("status").dataset.number = state.number;
    el("undo").disabled = !state.undo;
    el("reset").disabled = state.link === "{}";
    if (state.test) show_test(state.test);
    show_lives();
    if (state.columns) show_columns(state.columns);
    show_figures();
    show_pins();
    if (state.message !== undefined) el("message").textContent = state.message;
    el("replace").hidden = !state.exists;
    if (state.page) save_page(state.page);
    if (state.ended) window.wearsim_lost();
  };

  const show_test = test => {
    el("title").textContent = test.title;
    el("question").textContent = test.question;
    const [first, ...rest] = test.rows;
    el("answer-label").textContent = first[0];
    el("answer").textContent = first[1];
    el("basis").textContent = test.basis;
    rows_into(el("rows"), rest);
    const remarks = [...test.remarks, ...(state.lives?.remarks ?? [])];
    el("remarks").hidden = !remarks.length;
    el("remarks").replaceChildren(make("strong", {}, "Notes on this result"), make("ul", {}, ...remarks.map(text => make("li", {}, text))));
    el("pin").disabled = state.pins.length >= Number(document.body.dataset.pins ?? 4);
    const time = el("record"), last = Math.max(test.steps.length - 1, 0), at_end = time.value === time.max;
    el("time").hidden = last < 1;
    time.max = last;
    if (at_end) time.value = last;
    time.setAttribute("aria-valuetext", test.steps[time.value] ?? "");
    el("record-text").value = test.steps[time.value] ?? "";
  };

  const show_lives = () => {
    el("lives").hidden = !state.lives && state.progress === undefined;
    if (state.lives) {
      rows_into(el("life-rows"), state.lives.rows);
    }
    const done = state.progress, wanted = state.tests ? `${done} of ${state.tests} tests` : "the scatter of the wear factor alone";
    if (state.stage === "first") el("life-progress").textContent = "of an earlier design";
    else if (done !== undefined) el("life-progress").textContent = `computing ${wanted}`;
    else if (state.lives) el("life-progress").textContent = state.lives.tests === 1 && state.lives.last
      ? "the scatter of the wear factor is exact" : `from ${state.lives.tests} tests`;
  };

  // the numbers of all figures come in one text, since Bokeh sends a message for each of their columns
  const show_columns = ({ends, numbers}) => {
    const text = atob(numbers), bytes = new Uint8Array(text.length);
    for (let place = 0; place < text.length; place++) bytes[place] = text.charCodeAt(place);
    const all = new Float32Array(bytes.buffer);
    for (const [id, columns] of Object.entries(ends)) {
      const data = Object.fromEntries(Object.entries(columns).map(([name, [start, end]]) => [name, all.slice(start, end)]));
      Bokeh.documents[0].get_model_by_id(id)?.setv({data}, {sync: false});
    }
  };

  const show_figures = () => {
    const all = document.querySelectorAll("main figure");
    all.forEach((node, place) => {
      const shown = state.figures[place];
      node.hidden = !shown;
      if (!shown) return;
      node.querySelector("h3").textContent = shown.title;
      node.querySelector("figcaption").textContent = shown.caption;
      node.setAttribute("aria-label", `${shown.title}. ${shown.caption}`);
      if (shown.name === "turning") {
        el("turn").hidden = false;
        if (el("turn").parentElement !== node) node.append(el("turn"));
        if (shown.frames) {
          el("frame").max = shown.frames - 1;
          el("frame").disabled = el("play").disabled = false;
        }
      }
    });
    if (!state.figures.some(one => one.name === "turning")) { el("turn").hidden = true; stop(); }
    show_record();
    show_frame();
  };

  const sources = function* (name = null) {
    const slot = state.figures.findIndex(one => one.name === name);
    for (const doc of Bokeh.documents) for (const root of doc.roots())
      if (root.name?.startsWith("slot") && (name === null || root.name === `slot${slot}`))
        for (const plot of root.children ?? []) for (const renderer of plot.renderers ?? [])
          if (renderer.data_source) yield renderer.data_source;
  };

  const show_record = () => {
    const place = el("record").value;
    for (const source of sources()) if (source.name?.startsWith("record") && source.data[place] && source.data.shown !== source.data[place]) {
      source.data.shown = source.data[place];
      source.change.emit();
    }
  };

  const show_frame = () => {
    const slot = state.figures.find(one => one.name === "turning");
    if (!slot) return;
    const total = +el("frame").max + 1, text = `${Math.round(360 * el("frame").value / total)} deg`;
    el("frame-text").value = text;
    el("frame").setAttribute("aria-valuetext", text);
    if (!slot.frames) return;
    for (const source of sources("turning")) {
      let moved = false;
      for (const column of ["x", "y"]) {
        const further = source.data[`${column}@${el("frame").value}`];
        if (further) { source.data[column] = further; moved = true; }
      }
      if (moved) source.change.emit();
    }
  };

  const show_pins = () => {
    const [heads, rows] = state.differences;
    el("pins").hidden = !state.pins.length;
    el("pin-heads").replaceChildren(make("tr", {}, ...heads.map((text, place) => make(place ? "th" : "td", place ? {scope: "col"} : {}, place > 1 ? `pinned ${text}` : text))));
    el("pin-rows").replaceChildren(...rows.map(([head, ...cells]) => make("tr", {}, make("th", {scope: "row"}, head), ...cells.map(text => make("td", {}, text)))));
    el("unpin").replaceChildren(...state.pins.map((name, place) => {
      const button = make("button", {type: "button"}, `Remove ${name}`);
      button.addEventListener("click", () => send({do: "unpin", place}));
      return button;
    }));
  };

  const save_page = text => {
    const link = make("a", {href: URL.createObjectURL(new Blob([text], {type: "text/html"})), download: el("name").value.replace(/(\.toml)?$/, ".html")});
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
    el("message").textContent = `report: ${link.download}`;
  };

  window.wearsim_lost = () => {
    ended = true;
    stop();
    el("status").textContent = "The server has ended: this page shows its last result. Start wearsim explore again, and open the address that it prints.";
    el("status").classList.add("lost");
    el("status").setAttribute("role", "alert");
    for (const node of document.querySelectorAll(".values button, .values input, .values select, #save, #replace, #report")) node.disabled = true;
  };

  // what is done on the page -----------------------------------------------------------------------------------

  const stop = () => { clearInterval(playing); playing = 0; el("play").setAttribute("aria-pressed", "false"); };

  const copy = text => {
    el("copied-line").hidden = false;
    el("copied").value = text;
    navigator.clipboard?.writeText(text).catch(() => el("copied").select());
  };

  const connect = () => {
    el("search").addEventListener("input", filter);
    el("undo").addEventListener("click", () => send({do: "undo"}));
    el("reset").addEventListener("click", () => send({do: "reset"}));
    el("pin").addEventListener("click", () => send({do: "pin"}));
    el("save").addEventListener("click", () => send({do: "save", name: el("name").value}));
    el("replace").addEventListener("click", () => send({do: "save", name: el("name").value, force: true}));
    el("report").addEventListener("click", () => { el("message").textContent = "computing the report"; send({do: "report"}); });
    el("copy").addEventListener("click", () => copy(state.options || "the scenario is that of the file"));
    el("link").addEventListener("click", () => copy(`${location.origin}${location.pathname}#${encodeURIComponent(state.link)}`));
    el("record").addEventListener("input", () => {
      const text = state.test?.steps[el("record").value] ?? "";
      el("record-text").value = text;
      el("record").setAttribute("aria-valuetext", text);
      show_record();
    });
    el("frame").addEventListener("input", show_frame);
    el("play").addEventListener("click", () => {
      if (playing) { stop(); return; }
      el("play").setAttribute("aria-pressed", "true");
      playing = setInterval(() => { el("frame").value = (+el("frame").value + 1) % (+el("frame").max + 1); show_frame(); }, 80);
    });
    document.addEventListener("keydown", event => {
      if (event.key === "z" && (event.ctrlKey || event.metaKey) && event.target.type !== "text" && event.target.type !== "search") {
        event.preventDefault();
        send({do: "undo"});
      }
    });
  };

  const ready = () => {
    exchange = window.Bokeh?.documents[0]?.get_model_by_name("exchange");
    if (!exchange) { setTimeout(ready, 30); return; }
    window.wearsim_receive(exchange.reply);
    if (location.hash.length > 1) {
      try { send({do: "restore", changes: JSON.parse(decodeURIComponent(location.hash.slice(1)))}); }
      catch { el("message").textContent = "the link holds no changes"; }
      history.replaceState(null, "", location.pathname + location.search);
    }
    send({do: "show"});  // a later reply may have replaced the one with fields and columns
  };
  document.addEventListener("DOMContentLoaded", () => { connect(); ready(); });
})();
