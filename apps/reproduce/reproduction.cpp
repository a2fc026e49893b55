// SPDX-License-Identifier: MIT
#include <reproduce/reproduction.hpp>

namespace resonid::reproduction {

const std::vector<Entry>& entries() {
  static const std::vector<Entry> kEntries{
      {"i", "Publication I: PRBS in closed loop, output error off line, a controller from it", publication_i},
      {"ii", "Publication II: PRBS on a moving belt, direct recursive output error", publication_ii},
      {"iii", "Publication III: PRBS on a moving belt, indirect closed-loop output error", publication_iii},
      {"iv", "Publication IV: multisine, bank of Kalman filters, gap between two belts", publication_iv},
      {"v", "Publication V: sliding DFT of a multisine, model fitted to it while the cart runs",
       publication_v},
      {"vi", "Publication VI: chirp, one Kalman filter that follows it, Nyquist distances", publication_vi},
  };
  return kEntries;
}

}  // namespace resonid::reproduction
