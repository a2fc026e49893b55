// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/data/record.hpp>
#include <span>
#include <utility>
#include <vector>

namespace resonid::response {

/// Parts of one record whose excitation (the input, when the record has none) has the same period but
/// different phases, each with the first of its periods (its transient) taken off: a new part begins where a
/// period differs from the one before by more than half (rms). A record of one realisation gives one part;
/// stretches of fewer than three periods, and silent ones, give none.
[[nodiscard]] std::vector<data::Record> realisations_of(const data::Record& record,
                                                        std::size_t period_samples);

/// The first two of the records that are no realisations of one random-phase excitation: their amplitude
/// spectra differ (cosine below 0.9), or one is the other, shifted in time (correlation above 0.95); nothing
/// when all are. An excitation of fewer than four lines has no phases to tell realisations by.
[[nodiscard]] std::optional<std::pair<std::size_t, std::size_t>> no_realisations(
    std::span<const data::Record> records, std::size_t period_samples);

/// Period of an excitation that repeats a few times, at least three, and then goes on with other phases;
/// nothing for any other, and above 87 000 samples. Found in stretches of the record, from its start and in
/// its middle, and compared with the whole of it by realisations_of() and no_realisations().
[[nodiscard]] std::optional<std::size_t> detect_realisation_period(const data::Record& record);

}  // namespace resonid::response
