// Numbers as people read them.

export function duration(seconds) {
  const whole = Math.max(0, Math.floor(seconds));
  const pad = (number) => String(number).padStart(2, '0');
  const hours = Math.floor(whole / 3600);
  const rest = `${pad(Math.floor(whole / 60) % 60)}:${pad(whole % 60)}`;
  return hours > 0 ? `${hours}:${rest}` : rest;
}

export function number(value, digits = 2) {
  return Number.isFinite(value) ? value.toFixed(digits) : '–';
}

export function length(metres) {
  if (!Number.isFinite(metres)) return '–';
  return metres < 0.995 ? `${Math.round(100 * metres)} cm` : `${metres.toFixed(2)} m`;
}
