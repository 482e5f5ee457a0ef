// SPDX-License-Identifier: Apache-2.0
// Two short sounds, made on the spot. Browsers allow sound only after the first touch; until then there is the colour.

export class Sound {
  constructor() {
    this.on = true;
    const wake = () => { this.context ??= new AudioContext(); this.context.resume(); };
    for (const name of ['pointerdown', 'keydown']) addEventListener(name, wake, { once: true });
  }

  play(kind) {
    if (!this.on || this.context?.state !== 'running') return;
    const notes = kind === 'accepted' ? [[660, 0, 0.11], [990, 0.12, 0.16]] : [[196, 0, 0.22], [147, 0.26, 0.36]];
    for (const [frequency, start, length] of notes) this.#note(frequency, this.context.currentTime + start, length, kind === 'accepted' ? 'sine' : 'square');
  }

  #note(frequency, at, length, type) {
    const tone = new OscillatorNode(this.context, { frequency, type });
    const volume = new GainNode(this.context, { gain: 0 });
    volume.gain.setValueAtTime(0, at);
    volume.gain.linearRampToValueAtTime(type === 'sine' ? 0.3 : 0.14, at + 0.015);
    volume.gain.linearRampToValueAtTime(0, at + length);
    tone.connect(volume).connect(this.context.destination);
    tone.start(at);
    tone.stop(at + length + 0.02);
  }
}
