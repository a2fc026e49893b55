// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/fit/detail/order_selection.hpp>

namespace resonid::fit::detail {

/// A structure and its fit to all but the hold-out data.
struct Attempt {
  BlackBoxConfig config;
  BlackBoxFit fit;
};

/// Finds delay and integrator of one order after the other; each begins where the one before ended. Always by
/// the open-loop predictor with a noise model: a simulated loop takes ten times as long and asks for no other
/// structure.
class StructureSearch {
 public:
  StructureSearch(const data::Record& record, const OrderSelectionConfig& config);

  [[nodiscard]] expected<Attempt, Error> of_order(int order);
  [[nodiscard]] bool has_further_delay(const Attempt& attempt) const;

 private:
  [[nodiscard]] expected<Attempt, Error> attempted(const BlackBoxConfig& config) const;
  void try_integrator(Attempt& best) const;
  void try_delay(Attempt& best, std::size_t samples, bool direct) const;
  void find_delay(Attempt& best) const;
  [[nodiscard]] std::size_t rough_delay(const Attempt& known) const;

  const data::Record& record_;
  const OrderSelectionConfig& config_;
  BlackBoxConfig base_;
  std::optional<BlackBoxConfig> before_;  ///< What suited the order before.
};

}  // namespace resonid::fit::detail
