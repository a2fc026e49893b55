// SPDX-License-Identifier: MIT
// Recursive least squares of any equation that is linear in its parameters.
#ifndef RESONID_C_RLS_H
#define RESONID_C_RLS_H

#include <resonid/c/types.h>

RESONID_BEGIN

typedef struct resonid_rls resonid_rls;

/// How older samples lose weight.
enum {
  RESONID_FORGETTING_NONE = 0,        ///< Never: for a constant machine.
  RESONID_FORGETTING_CONSTANT = 1,    ///< By `factor` per sample.
  RESONID_FORGETTING_VARIABLE = 2,    ///< The faster, the larger the newest error is against the usual one.
  RESONID_FORGETTING_DIRECTIONAL = 3  ///< Only what the newest regressor tells about.
};
#define RESONID_RLS_MAX_PARAMETERS 12
#define RESONID_RLS_SIZE 2560  ///< Enough for every configuration.

/// Arrays are read by init and create only.
typedef struct resonid_rls_config {
  uint32_t struct_size;  ///< Set by resonid_rls_defaults().
  uint32_t precision;    ///< RESONID_DOUBLE or RESONID_FLOAT.
  uint32_t parameters;   ///< 1 ... RESONID_RLS_MAX_PARAMETERS.
  uint32_t forgetting;   ///< RESONID_FORGETTING_...
  const double* start;   ///< [parameter] before the first sample, or NULL: 0.
  const double* scale;   ///< [parameter] typical size of its regressor, > 0, or NULL: 1.
  const uint32_t* held;  ///< [parameter] not 0: stays at its start; or NULL: none does.
  /// Variance of each parameter's start per unit variance of the residual, times its scale squared; > 0.
  double start_variance;
  double factor;             ///< Weight that a sample keeps per sample, in (0, 1].
  double smallest_factor;    ///< Least factor of variable forgetting, in (0, factor].
  double noise_variance;     ///< Usual variance of the error, for variable forgetting; 0: learned.
  double largest_variance;   ///< Upper limit of each parameter's variance over its start's, >= 1.
  double smallest_variance;  ///< Lower limit likewise: stays alert without forgetting; 0 ... 1.
} resonid_rls_config;

typedef struct resonid_rls_info {
  uint32_t struct_size;  ///< Bytes that were filled.
  uint32_t parameters;
  uint32_t excited;  ///< 0 while the samples of the memory tell next to nothing new.
  uint32_t reserved;
  uint64_t samples;          ///< Since init or reset, missing ones included.
  uint64_t skipped_samples;  ///< Of these, missing ones: anything in them was not finite.
  double residual;           ///< Newest value minus its prediction from the estimate before it.
  double residual_variance;  ///< Of the equation error, over the memory; infinite before the first sample.
  double memory_samples;     ///< Sum of the weights that forgetting has left.
  double mean_age_samples;   ///< Mean age of the remembered samples by their weights.
} resonid_rls_info;

/// Fills a configuration of `struct_size` = sizeof(*config) bytes with defaults.
RESONID_API resonid_status resonid_rls_defaults(resonid_rls_config* config,
                                                size_t struct_size) RESONID_NOEXCEPT;
/// Bytes that a handle of this configuration needs, at most RESONID_RLS_SIZE; 0: there is no such handle.
RESONID_API size_t resonid_rls_size(const resonid_rls_config* config) RESONID_NOEXCEPT;
/// As resonid_line_bank_init().
RESONID_API resonid_status resonid_rls_init(void* memory, size_t size, const resonid_rls_config* config,
                                            resonid_rls** handle, resonid_error* error) RESONID_NOEXCEPT;
/// As resonid_line_bank_create().
RESONID_API resonid_status resonid_rls_create(const resonid_rls_config* config, resonid_rls** handle,
                                              resonid_error* error) RESONID_NOEXCEPT;
/// One equation  value = regressor' parameters + error,  [parameter], `weight` > 0 times as certain as usual
/// (1). Real-time safe.
RESONID_API resonid_status resonid_rls_step(resonid_rls* handle, const double* regressor, double value,
                                            double weight) RESONID_NOEXCEPT;
/// `count` samples were lost: as many missing ones, in bounded time. Real-time safe.
RESONID_API resonid_status resonid_rls_miss(resonid_rls* handle, uint64_t count) RESONID_NOEXCEPT;
/// Back to the state after init, without the cost of it. Real-time safe.
RESONID_API resonid_status resonid_rls_reset(resonid_rls* handle) RESONID_NOEXCEPT;
/// Newest estimate, [parameter]; `count` must be that of the parameters. Real-time safe.
RESONID_API resonid_status resonid_rls_parameters(const resonid_rls* handle, double* parameters,
                                                  size_t count) RESONID_NOEXCEPT;
/// Covariance of the estimate, [row][column], `count` = parameters squared; right for white equation errors,
/// infinite until there are more samples than parameters. Real-time safe.
RESONID_API resonid_status resonid_rls_covariance(const resonid_rls* handle, double* covariance,
                                                  size_t count) RESONID_NOEXCEPT;
/// Fills the first `struct_size` bytes of `info`. Real-time safe.
RESONID_API resonid_status resonid_rls_get_info(const resonid_rls* handle, resonid_rls_info* info,
                                                size_t struct_size) RESONID_NOEXCEPT;

RESONID_END

#endif
