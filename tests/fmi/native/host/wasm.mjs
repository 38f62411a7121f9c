// Runs a plan in a module made of wasm.c: node wasm.mjs MODULE PLAN ROWS

import { readFileSync, writeFileSync } from "node:fs";

const [module, plan, rows] = process.argv.slice(2);
const { instance } = await WebAssembly.instantiate(readFileSync(module), {});
const { memory, __heap_base, run, message } = instance.exports;
const file = readFileSync(plan);
const numbers = new Float64Array(file.buffer.slice(file.byteOffset, file.byteOffset + file.length));
const size = 8 * (numbers[1] + 1) * numbers[4];
const room = 1 << 20;
const base = Math.ceil(__heap_base.value / 16) * 16;
const places = [base, base + file.length, base + file.length + size, base + file.length + 2 * size];
memory.grow(Math.ceil((places[3] + room) / 65536) - memory.buffer.byteLength / 65536 + 1);
new Uint8Array(memory.buffer).set(file, base);
try {
  run(...places, room);
} catch (error) {
  const text = new Uint8Array(memory.buffer).subarray(message());
  console.error(`host: ${Buffer.from(text.subarray(0, text.indexOf(0)))} (${error.message})`);
  process.exit(1);
}
writeFileSync(rows, new Uint8Array(memory.buffer, places[1], size));
