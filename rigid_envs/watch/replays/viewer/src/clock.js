// Time of the replay: playing, speed, and who must be told.

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

export class Clock {
  constructor(duration, steps) {
    this.duration = duration;
    this.steps = steps; // times of the steps of the longest episode
    this.time = 0;
    this.speed = 1;
    this.playing = false;
    this.loop = true;
    this.listeners = [];
  }

  changed() {
    for (const listener of this.listeners) listener(this);
  }

  seek(time) {
    this.time = Math.min(Math.max(time, 0), this.duration);
    this.changed();
  }

  play(on = !this.playing) {
    if (on && this.time >= this.duration) this.time = 0;
    this.playing = on;
    this.changed();
  }

  setSpeed(speed) {
    this.speed = speed;
    this.changed();
  }

  // To the next step of the environment, or the one before.
  step(count) {
    const tiny = 1e-9 * Math.max(this.duration, 1);
    const later = this.steps.findIndex((time) => time > this.time + tiny);
    const next = later < 0 ? this.steps.length : later;
    const at = this.steps[next - 1] < this.time - tiny && count < 0 ? next : next - 1;
    this.playing = false;
    this.seek(this.steps[Math.min(Math.max(at + count, 0), this.steps.length - 1)]);
  }

  advance(seconds) {
    if (!this.playing) return;
    let time = this.time + seconds * this.speed;
    if (time >= this.duration) {
      if (this.loop && this.time >= this.duration) time = 0;
      else time = this.duration; // the last picture is seen before it begins again
      this.playing = this.loop;
    }
    this.time = time;
    this.changed();
  }
}
