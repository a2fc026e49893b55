// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <identification/identify/judge/judge.hpp>
#include <identification/identify/judge/loop.hpp>
#include <optional>
#include <resonid/data/record.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/result.hpp>
#include <span>

namespace resonid::identification::detail {

/// The loop of a model, as the result's own was found.
using LoopOfModel = std::function<std::optional<LoopResult>(const PlantModel&)>;

/// One repetition of the experiment, fitted: its model in an otherwise empty result; none when its fit did
/// not come out. Depends on the seed only; called from several threads.
using Repetition = std::function<std::optional<Result>(std::uint64_t seed)>;

/// Of one record. Keeps a reference to the record.
///
/// A model of the record: with the simulated output yh, the residual's autoregressive model and new white
/// noise w,
///
///   y* = yh + n*,  A(z) n* = w,  w ~ N(0, variance)        u* = u                        open loop
///   y* = yh + G du + n*,  u* = u + du,  du = -C/(1 + C G) (n* - (y - yh))                controller known
///
/// and the model is fitted to (u*, y*) again, from where it is. Initial state and offset are in yh, and in
/// the loop only differences to the record pass through G, so no state has to be known. A model of the
/// response is fitted to lines around the model's own, each with its standard deviation.
[[nodiscard]] Repetition repetition_of(const data::Record& record, const Plan& plan, const Options& options,
                                       const Result& result);

/// Of all records at once, which one likelihood gave the model: every one is repeated with its own initial
/// state, offset and noise. Keeps references to the records. Empty when the model cannot be simulated on
/// them.
[[nodiscard]] Repetition repetition_of(std::span<const data::Record> records, const Plan& plan,
                                       const Options& options, const ModelResult& model);

/// Why a bootstrap of a model of the response must not be shown, if so: its replicas scatter less than half
/// as much as the covariance says, which holds what lines miss together and independent noise does not
/// repeat.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_bootstrap(const Bootstrap& bootstrap,
                                                                    const Result& result);

/// Parametric bootstrap (Efron and Tibshirani 1993, ch. 6): the experiment repeated on the fitted model.
///
/// Intervals lie between the (1-c)/2 and (1+c)/2 quantiles of the replicas. They follow the shape that the
/// estimates really have, which the covariance cannot: short records, a damping near zero, margins that jump
/// from one crossover to another. Limits: noise is Gaussian and the structure is right; what the model leaves
/// out is noise. Replica i depends on seed and i only. `modes_hz`: where a black box shows its modes.
[[nodiscard]] Bootstrap bootstrap(const Repetition& repetition, const Options& options, const Result& result,
                                  const LoopOfModel& loop_of_model, std::pair<double, double> modes_hz);

/// The last step of identify(): the bootstrap of its result, or the finding that says why there is none.
void put_bootstrap(const Experiment& experiment, const Measurement& measurement, const Options& options,
                   Result& result);

}  // namespace resonid::identification::detail
