// SPDX-License-Identifier: MIT
// Figures of one axis at two dates, and whether they differ.
import { isNumber, significant } from "./report/format.js";
import { get, part } from "./api.js";
import { compareForm } from "./axis.js";
import { grid, h, renew, say } from "./dom.js";
import { link } from "./route.js";
import { changeText, figureOf, orderedFigures, stamp, valueText } from "./words.js";

/** In standard deviations of the difference: by chance once in 370 figures. */
const SIGNIFICANT = 3;

export function compareView(main, { fleet, path, query, serverNow }) {
  const name = path[1];
  const [a, b] = [Number(query.a), Number(query.b)];
  const result = h("section", { "aria-live": "polite" }, h("h2", {}, "Then and then"), h("p", { class: "explain" }, "Loading …"));
  main.append(h("p", { class: "crumb" }, h("a", { href: link(["axis", name]) }, `← ${name}`)), h("h1", {}, `${name}: two dates`), result, compareForm(name, () => Math.max(serverNow(), fleet.axes.get(name)?.time_s ?? 0), isNumber(a) ? a : undefined, isNumber(b) ? b : undefined));
  const text = result.querySelector("p");
  const table = h("div", {});
  result.append(table);
  let draw = () => {};
  const load = async () => {
    try {
      const answer = await get(`axes/${part(name)}/compare?a=${a}&b=${b}`);
      const figures = answer.figures ?? {};
      const [at, bt] = [answer.a_time_s ?? a, answer.b_time_s ?? b];
      const names = orderedFigures(figures);
      say(text, names.length ? `± one standard deviation; means of ten minutes around each date, of less where they are closer, or of the nearest hour or day; figures without values there are left out. ${names.filter((n) => differs(figures[n])).length} of ${names.length} figures differ significantly, by more than ${SIGNIFICANT} standard deviations.` : "Nothing is stored at one of these dates.");
      if (names.length === 0) return;
      // The units may be known later.
      draw = () => renew(table, fleet.axes.get(name)?.units ?? "", () => [grid(["Figure", stamp(at), stamp(bt), "Difference", "Standard deviations", "Significant"], names.map((key) => {
        const told = figures[key];
        const figure = figureOf(key, fleet.axes.get(name));
        const s = sigmaOf(told);
        return [figure.title, valueText(figure, told.a), valueText(figure, told.b),
          changeText(figure, { change: told.difference, change_std: told.std, baseline: told.a?.value }) || "–", s === null ? "–" : significant(s, 2), differs(told) ? h("b", {}, "yes") : s === null ? "not known" : "no"];
      }), { caption: "Figures at both dates", numeric: [1, 2, 3, 4] })]);
      draw();
    } catch (error) {
      say(text, `The comparison could not be made: ${error.message}`);
    }
  };
  load();
  return { title: `${name}: two dates`, nav: "fleet", update: () => draw() };
}

const sigmaOf = ({ difference, std, sigma }) => (isNumber(sigma) ? Math.abs(sigma) : isNumber(difference) && std > 0 ? Math.abs(difference) / std : null);
const differs = (told) => (sigmaOf(told) ?? 0) > SIGNIFICANT;
