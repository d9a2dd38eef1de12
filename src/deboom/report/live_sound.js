// The run-up of one vehicle: today's design and this one run in step, a press switches over at the
// same engine speed. One full scale for all, that of `deboom listen`; louder designs are cut off.

const player = {
  context: null, sources: null, v: 0, which: "today", start: 0,
  press(v, which) {
    if (this.sources && this.v === v) return this.which === which ? this.stop() : this.switchTo(which);
    this.stop();
    this.context = this.context || new AudioContext();
    this.context.resume();
    this.v = v;
    this.start = this.context.currentTime + 0.05;
    this.sources = {};
    this.add("today", model.ones);
    this.add("now", session.x);
    this.sources.today.source.onended = () => this.stop();
    this.switchTo(which);
    this.advance();
  },
  advance() {
    if (!this.sources) return;
    const part = Math.min(1, Math.max(0, (this.context.currentTime - this.start) / data.seconds));
    readAt(Math.round(part * (F - 1)));
    requestAnimationFrame(() => this.advance());
  },
  add(which, x, from = 0) {
    const { re, im } = model.pressure(x, session.shown, session.coupled);
    const at = this.v * F, rate = this.context.sampleRate;
    const sound = runUpSound(re.subarray(at, at + F), im.subarray(at, at + F), data.frequency, data.seconds, rate);
    const buffer = this.context.createBuffer(1, sound.length, rate);
    buffer.copyToChannel(Float32Array.from(sound, (pascal) => pascal / data.fullScale), 0);
    const source = new AudioBufferSourceNode(this.context, { buffer }), gain = new GainNode(this.context, { gain: 0 });
    source.connect(gain).connect(this.context.destination);
    source.start(Math.max(this.start, this.context.currentTime), from);
    this.sources[which] = { source, gain };
  },
  switchTo(which) {
    this.which = which;
    for (const [name, { gain }] of Object.entries(this.sources)) gain.gain.setTargetAtTime(name === which ? 1 : 0, this.context.currentTime, 0.02);
    this.mark();
  },
  follow() { // sliders move while it plays: the new design goes on at the same engine speed
    if (!this.sources) return;
    const { source, gain } = this.sources.now;
    gain.gain.setTargetAtTime(0, this.context.currentTime, 0.02);
    source.stop(this.context.currentTime + 0.2);
    this.add("now", session.x, Math.max(0, this.context.currentTime - this.start));
    this.switchTo(this.which);
  },
  stop() {
    if (!this.sources) return;
    for (const { source } of Object.values(this.sources)) {
      source.onended = null;
      source.stop();
    }
    this.sources = null;
    readAt(null);
    this.mark();
  },
  mark() {
    for (const { v, play } of cards) {
      ["today", "now"].forEach((which, at) => {
        const on = this.sources !== null && this.v === v && this.which === which;
        play[at].classList.toggle("on", on);
        play[at].setAttribute("aria-pressed", on);
      });
    }
  },
};
