// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <resonid/report/detail/typography.hpp>

namespace resonid::report {
namespace {

struct Replacement {
  std::string_view plain, set;
  enum class Place { word, end_of_word, anywhere } place = Place::word;
};
using Place = Replacement::Place;

/// Units first become words, then their powers are raised.
constexpr std::array kUnits = {Replacement{"kgm2", "kg m2"}, Replacement{"Nms/rad", "Nm s/rad"},
                               Replacement{"Ns/m", "N s/m"}, Replacement{"kg m^2", "kg m2"}};
constexpr std::array kSigns = {Replacement{"+-", "\u00b1"},
                               Replacement{"kg m2", "kg m\u00b2"},
                               Replacement{"chi2", "\u03c7\u00b2"},
                               Replacement{"/s2", "/s\u00b2", Place::end_of_word},
                               Replacement{"/s^2", "/s\u00b2", Place::end_of_word},
                               Replacement{" s2/", " s\u00b2/", Place::anywhere},
                               Replacement{")^2", ")\u00b2", Place::anywhere}};

constexpr std::string_view kBefore = " \n([\"", kAfter = " \n)],;:?/\"";

bool begins_word(std::string_view text, std::size_t at) {
  return at == 0 || kBefore.find(text[at - 1]) != std::string_view::npos;
}

/// A full stop ends a word where the sentence ends, not in a file's name.
bool ends_word(std::string_view text, std::size_t at) {
  if (at < text.size() && text[at] == '.') ++at;
  return at >= text.size() || kAfter.find(text[at]) != std::string_view::npos;
}

bool applies(const Replacement& r, std::string_view text, std::size_t at) {
  if (!text.substr(at).starts_with(r.plain)) return false;
  if (r.place == Place::anywhere) return true;
  const std::size_t end = at + r.plain.size();
  if (r.place == Place::word && !begins_word(text, at)) return false;
  if (ends_word(text, end)) return true;
  return r.plain == "+-" && text[end] >= '0' && text[end] <= '9';  // "+-2.3 Nm"
}

/// Where what begins at `at` and is to be copied ends; `at` itself where nothing of the kind begins.
std::size_t end_of_verbatim(std::string_view text, std::size_t at) {
  constexpr std::string_view kCommand = "resonid ";
  if (begins_word(text, at) && text.substr(at).starts_with(kCommand))
    return std::min(text.find('\n', at), text.size());
  if (text[at] != '\'' || !begins_word(text, at)) return at;
  const auto line_end = std::min(text.find('\n', at), text.size());
  for (auto close = text.find('\'', at + 1); close < line_end; close = text.find('\'', close + 1))
    if (ends_word(text, close + 1)) return close + 1;
  return at;
}

template <std::size_t Count>
std::string replaced(std::string_view text, const std::array<Replacement, Count>& replacements) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    if (const auto end = end_of_verbatim(text, at); end > at) {
      out += text.substr(at, end - at);
      at = end;
      continue;
    }
    const auto* found = std::find_if(replacements.begin(), replacements.end(),
                                     [&](const Replacement& r) { return applies(r, text, at); });
    if (found == replacements.end()) {
      out += text[at++];
    } else {
      out += found->set;
      at += found->plain.size();
    }
  }
  return out;
}

}  // namespace

std::string unit_words(std::string_view unit) { return replaced(unit, kUnits); }

std::string typeset(std::string_view text) { return replaced(unit_words(text), kSigns); }

}  // namespace resonid::report
