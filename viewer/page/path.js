// The path of the instrument, which `dibs view` packs: a count and so many numbers a tick, all little-endian f32.
export function unpack(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const numbers = Array.from({ length: bytes.byteLength / 4 }, (_, at) => view.getFloat32(4 * at, true));
  const path = [];
  for (let at = 0; at < numbers.length; at += 1 + numbers[at]) path.push(numbers.slice(at + 1, at + 1 + numbers[at]));
  return path;
}

// The record of each tick: a filter's reason, the separation (mm) that its motion keeps, the energy (mJ) left; NaN is unknown.
export const recorded = (rows, reasons) => rows.map(([reason, least, energy]) => ({ reason: reasons[reason], least, energy }));
