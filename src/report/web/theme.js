// SPDX-License-Identifier: MIT
// Canvas pictures take their colours from the style sheet at every drawing, so that dark mode and print follow it.

export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
}
