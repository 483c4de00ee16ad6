// Numbers with units: written with SI prefixes, read with the suffixes of netlists.

const PREFIXES = [[1e-18, "a"], [1e-15, "f"], [1e-12, "p"], [1e-9, "n"], [1e-6, "µ"], [1e-3, "m"], [1, ""], [1e3, "k"], [1e6, "M"], [1e9, "G"], [1e12, "T"]];
const PREFIXED = new Set(["m", "s", "Hz", "V", "A", "W", "C", "F", "N", "S", "rad", "m/s", "rad/s", "Ω", "N·m", "N m", "Pa", "J", "g"]);
const SUFFIXES = { a: 1e-18, f: 1e-15, p: 1e-12, n: 1e-9, u: 1e-6, "µ": 1e-6, m: 1e-3, k: 1e3, K: 1e3, M: 1e6, G: 1e9, T: 1e12 };

/** The prefix of a value in a unit: its factor and its name. */
export function prefixOf(value, unit) {
  const size = Math.abs(value);
  if (!PREFIXED.has(unit) || !(size > 0) || !Number.isFinite(size)) return [1, ""];
  let found = PREFIXES[0];
  for (const prefix of PREFIXES) if (size >= 0.99999 * prefix[0]) found = prefix;
  return found;
}

/** A number with so many significant digits, without an exponent where that is short. */
export function digits(value, count = 4) {
  if (value === 0) return "0";
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const size = Math.abs(value);
  const text = size >= 1e5 || size < 1e-3 ? value.toExponential(count - 1) : value.toPrecision(count);
  const short = text.includes("e") ? String(Number(value.toPrecision(count))) : text;
  return (size >= 1e5 || size < 1e-3 ? text.replace("e+", "e") : short).replace("-", "−");
}

/** A quantity for people: "17.84 V", "86.31 kHz". */
export function quantity(value, unit = "", count = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const [factor, name] = prefixOf(value, unit);
  return `${digits(value / factor, count)} ${name}${unit}`.trim();
}

/** The value of a text such as 2.1u, -3e-6 or 30n; null where it is no number. */
export function readNumber(text) {
  const match = /^\s*([-+−]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([afpnuµmkKMGT]?)[A-Za-zΩ/·]*\s*$/.exec(text);
  if (!match) return null;
  const value = Number(match[1].replace("−", "-")) * (match[2] ? SUFFIXES[match[2]] : 1);
  return Number.isFinite(value) ? value : null;
}

/** A number as netlists write it: 2.1u. */
export function netlistNumber(value) {
  const size = Math.abs(value);
  if (!(size > 0) || (size >= 0.1 && size < 1000)) return String(Number(value.toPrecision(6)));
  for (const [factor, name] of PREFIXES) {
    if (size >= 0.99999 * factor && size < 999.99 * factor) return Number((value / factor).toPrecision(6)) + (name === "µ" ? "u" : name);
  }
  return value.toExponential(5);
}
