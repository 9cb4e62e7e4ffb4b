// The instrument in the hand: mouse and touch drag it, keys move and turn it.
import { Plane, Raycaster, Vector2, Vector3 } from "three";

// Pixels around the instrument at which it is still grabbed.
const GRASP = { mouse: 10, pen: 14, touch: 26 };

const point = (pose, at) => new Vector3(pose[at], pose[at + 1], pose[at + 2]);

export class Hand {
  // `pose()` gives the instrument, `moved(pose)` takes it.
  constructor(view, picture, pose, moved) {
    Object.assign(this, { view, picture, pose, moved, grip: null });
    view.addEventListener("keydown", (event) => this.key(event));
    if (!picture) return;
    const canvas = picture.renderer.domElement;
    canvas.addEventListener("pointerdown", (event) => this.grab(event), { capture: true });
    canvas.addEventListener("pointermove", (event) => this.drag(event), { capture: true });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => this.release(event), { capture: true });
    }
  }

  // Where a point is seen, in pixels.
  seen(place) {
    const { left, top, width, height } = this.picture.renderer.domElement.getBoundingClientRect();
    const { x, y } = place.clone().project(this.picture.camera);
    return new Vector2(left + ((x + 1) / 2) * width, top + ((1 - y) / 2) * height);
  }

  ray(event) {
    const { left, top, width, height } = this.picture.renderer.domElement.getBoundingClientRect();
    const place = new Vector2((2 * (event.clientX - left)) / width - 1, 1 - (2 * (event.clientY - top)) / height);
    const caster = new Raycaster();
    caster.setFromCamera(place, this.picture.camera);
    return caster.ray;
  }

  // The share of the axis under the pointer, or null.
  under(event) {
    const pose = this.pose();
    const cursor = new Vector2(event.clientX, event.clientY);
    const start = this.seen(point(pose, 0));
    const radius = pose.at(-1);
    const side = new Vector3().setFromMatrixColumn(this.picture.camera.matrixWorld, 0);
    const wide = this.seen(point(pose, 0).addScaledVector(side, radius)).distanceTo(start);
    const end = pose.length === 7 ? this.seen(point(pose, 3)) : start;
    const way = end.clone().sub(start);
    const share = way.lengthSq() > 0 ? Math.min(Math.max(cursor.clone().sub(start).dot(way) / way.lengthSq(), 0), 1) : 0;
    const distance = start.clone().addScaledVector(way, share).distanceTo(cursor);
    return distance <= wide + GRASP[event.pointerType || "mouse"] ? share : null;
  }

  grab(event) {
    if (this.grip || event.button !== 0) return;
    const share = this.under(event);
    if (share === null) return;
    event.stopImmediatePropagation();
    const pose = [...this.pose()];
    const start = point(pose, 0);
    const held = pose.length === 7 ? start.clone().lerp(point(pose, 3), share) : start;
    const facing = this.picture.camera.getWorldDirection(new Vector3());
    const plane = new Plane().setFromNormalAndCoplanarPoint(facing, held);
    const from = this.ray(event).intersectPlane(plane, new Vector3());
    if (!from) return;
    // The ends turn the instrument, its middle moves it.
    const ends = pose.length === 7 ? (share < 0.2 ? [0] : share > 0.8 ? [3] : [0, 3]) : [0];
    this.grip = { pose, plane, from, ends, pointer: event.pointerId };
    this.picture.orbit.enabled = false;
    event.target.setPointerCapture(event.pointerId);
    this.view.focus();
  }

  drag(event) {
    if (this.grip?.pointer !== event.pointerId) {
      if (!this.grip) event.target.style.cursor = this.under(event) === null ? "" : "grab";
      return;
    }
    const to = this.ray(event).intersectPlane(this.grip.plane, new Vector3());
    if (!to) return;
    const pose = [...this.grip.pose];
    for (const end of this.grip.ends) {
      point(pose, end).add(to).sub(this.grip.from).toArray(pose, end);
    }
    this.moved(pose);
  }

  release(event) {
    if (this.grip?.pointer !== event.pointerId) return;
    this.grip = null;
    this.picture.orbit.enabled = true;
  }

  key(event) {
    const camera = this.picture?.camera;
    const column = (at) => (camera ? new Vector3().setFromMatrixColumn(camera.matrixWorld, at) : new Vector3().setComponent([0, 2, 1][at], 1));
    const [right, up, near] = [0, 1, 2].map(column);
    const step = (this.picture?.radius ?? 50) * (event.shiftKey ? 0.002 : 0.02);
    const moves = {
      ArrowLeft: [right, -1], ArrowRight: [right, 1], ArrowUp: [up, 1], ArrowDown: [up, -1], PageUp: [near, -1], PageDown: [near, 1],
    };
    const turns = { a: [up, 1], d: [up, -1], w: [right, 1], s: [right, -1] };
    const pose = [...this.pose()];
    const ends = pose.length === 7 ? [0, 3] : [0];
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (moves[key]) {
      const [axis, sign] = moves[key];
      for (const end of ends) point(pose, end).addScaledVector(axis, sign * step).toArray(pose, end);
    } else if (turns[key] && pose.length === 7) {
      const [axis, sign] = turns[key];
      const start = point(pose, 0);
      const span = point(pose, 3).sub(start).applyAxisAngle(axis, sign * (event.shiftKey ? 0.005 : 0.05));
      start.add(span).toArray(pose, 3);
    } else {
      return;
    }
    event.preventDefault();
    this.moved(pose);
  }
}
