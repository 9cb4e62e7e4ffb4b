// Colours that the colour-blind can tell apart (Okabe and Ito 2008).
import { Color } from "three";

const FAR = new Color("#56b4e9");
const NEAR = new Color("#0072b2");
const TOUCHING = new Color("#e69f00");
const DEEP = new Color("#d55e00");
export const UNKNOWN = new Color("#666666");
export const FORCE = new Color("#a3407a");
export const COMMANDED = new Color("#8a94a0");
export const SPHERE = new Color("#009e73");

// Blue outside, darker the nearer; orange from contact on, redder the deeper. `range` is a distance in mm, and a quarter of
// it is deep: walls are thinner than the room about them.
export function ofSeparation(separation, range) {
  const share = (distance) => Math.min(Math.abs(separation) / distance, 1);
  return separation > 0 ? NEAR.clone().lerp(FAR, share(range)) : TOUCHING.clone().lerp(DEEP, share(range / 4));
}
