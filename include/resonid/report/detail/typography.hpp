// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace resonid::report {

/// The characters that a text is written in.
enum class Characters {
  ascii,    ///< "0.032 +- 0.001 kg m2"
  unicode,  ///< UTF-8: "0.032 ± 0.001 kg m²"
};

/// A text of this library, which is ASCII, as print sets it: the signs ± and χ², raised powers of units,
/// "kgm2" as "kg m²", "Nms/rad" as "Nm s/rad". What stands in quotes ('acc m/s2') or after a command's name
/// ("resonid identify ...") is to be copied and stays as it is. A text that is typeset stays as it is.
[[nodiscard]] std::string typeset(std::string_view text);

/// A unit as people write it, in ASCII: "kgm2" is "kg m2", "Nms/rad" is "Nm s/rad". typeset() keeps its
/// width.
[[nodiscard]] std::string unit_words(std::string_view unit);

}  // namespace resonid::report
