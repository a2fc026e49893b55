// SPDX-License-Identifier: MIT
#include <resonid/c/detail/models.h>
#include <resonid/c/detail/types.h>

#include <cstdlib>

#include "handle.hpp"

#define RESONID_TEXT_OF(x) #x
#define RESONID_TEXT(x) RESONID_TEXT_OF(x)
#define RESONID_VERSION_TEXT          \
  RESONID_TEXT(RESONID_VERSION_MAJOR) \
  "." RESONID_TEXT(RESONID_VERSION_MINOR) "." RESONID_TEXT(RESONID_VERSION_PATCH)

namespace resonid::c {

static_assert(std::string_view(RESONID_VERSION_TEXT) == RESONID_PROJECT_VERSION,
              "the version in resonid/c/detail/types.h is that of the project");

const Family* family(std::uint32_t kind) noexcept {
  static constexpr const Family* kFamilies[] = {&kExcitation, &kLineBank, &kTracker,  &kResponse,
                                                &kRls,        &kModel,    &kPhysical, &kChange,
                                                &kGuard,      &kEncoder,  &kAxis,     &kControl};
  const std::uint32_t id = family_of(kind);
  return id >= 1 && id <= std::size(kFamilies) ? kFamilies[id - 1] : nullptr;
}

namespace {

/// Null when there is no such kind.
const Family* family_with(std::uint32_t kind) noexcept {
  const Family* f = family(kind);
  return f != nullptr && type_of(kind) < f->types ? f : nullptr;
}
void* address(resonid_handle* handle) noexcept { return handle; }

/// The family of the settings, or why there is none.
resonid_status family_of_settings(const resonid_settings* settings, const Family*& found,
                                  resonid_error* error) noexcept {
  if (settings == nullptr) return fail_null(error, "settings");
  if (settings->struct_size < sizeof *settings)
    return fail(error, RESONID_ERROR_SIZE, "struct_size", "must be set by resonid_defaults()");
  found = family_with(settings->kind);
  if (found == nullptr)
    return fail(error, RESONID_ERROR_RANGE, "kind", "must be one of its constants", settings->kind);
  return RESONID_OK;
}

template <class Input, class Run>
resonid_status run_signals(resonid_handle* handle, const Input* ru, const Input* u, const Input* y,
                           std::size_t count, Run Operations::*operation) noexcept {
  return with(handle, [&](const Operations& o) -> resonid_status {
    if (o.*operation == nullptr) return RESONID_ERROR_UNSUPPORTED;
    if (count == 0) return RESONID_OK;
    if (y == nullptr || (u == nullptr && o.needs_u) || (ru == nullptr && o.needs_ru))
      return RESONID_ERROR_NULL;
    (o.*operation)(address(handle), ru, u, y, count);
    return RESONID_OK;
  });
}

}  // namespace
}  // namespace resonid::c

using resonid::c::Family;
using resonid::c::Header;
using resonid::c::Operations;
using resonid::c::with;

const char* resonid_version(void) noexcept { return RESONID_VERSION_TEXT; }

uint32_t resonid_version_number(void) noexcept { return resonid::c::kVersion; }

const char* resonid_status_string(resonid_status status) noexcept {
  switch (status) {
    case RESONID_OK:
      return "done";
    case RESONID_ERROR_NULL:
      return "an argument that must not be NULL is";
    case RESONID_ERROR_HANDLE:
      return "no handle of this library version";
    case RESONID_ERROR_SIZE:
      return "memory too small, or a struct size that is none";
    case RESONID_ERROR_ALIGNMENT:
      return "memory is not aligned";
    case RESONID_ERROR_SETTINGS:
      return "a field of the settings is refused";
    case RESONID_ERROR_RANGE:
      return "no such line, channel, count or kind";
    case RESONID_ERROR_MEMORY:
      return "no memory";
    case RESONID_ERROR_UNSUPPORTED:
      return "the handle's kind has no such function or figure";
    case RESONID_ERROR_SNAPSHOT:
      return "the snapshot is damaged";
    default:
      return "unknown status";
  }
}

resonid_status resonid_defaults(resonid_settings* settings, size_t struct_size, uint32_t kind) noexcept {
  const Family* family = resonid::c::family_with(kind);
  return family != nullptr ? family->defaults(settings, struct_size, kind) : RESONID_ERROR_RANGE;
}

size_t resonid_size(const resonid_settings* settings) noexcept {
  const Family* family = nullptr;
  const bool known = resonid::c::family_of_settings(settings, family, nullptr) == RESONID_OK;
  return known ? family->size(settings) : 0;
}

resonid_status resonid_init(void* memory, size_t size, const resonid_settings* settings,
                            resonid_handle** handle, resonid_error* error) noexcept {
  if (handle == nullptr) return resonid::c::fail_null(error, "handle");
  const Family* family = nullptr;
  if (const resonid_status status = resonid::c::family_of_settings(settings, family, error)) return status;
  const resonid_status status = family->init(memory, size, settings, error);
  if (status == RESONID_OK) *handle = static_cast<resonid_handle*>(memory);
  return status;
}

resonid_status resonid_create(const resonid_settings* settings, resonid_handle** handle,
                              resonid_error* error) noexcept {
  if (handle == nullptr) return resonid::c::fail_null(error, "handle");
  const std::size_t size = resonid_size(settings);
  // Without a size, init finds out what is wrong before it looks at the memory.
  void* memory = size > 0 ? std::aligned_alloc(RESONID_ALIGNMENT, size) : nullptr;
  if (size > 0 && memory == nullptr)
    return resonid::c::fail(error, RESONID_ERROR_MEMORY, "settings", "need more memory than there is");
  const resonid_status status = resonid_init(memory, size, settings, handle, error);
  if (status != RESONID_OK) std::free(memory);
  return status;
}

void resonid_destroy(resonid_handle* handle) noexcept { std::free(handle); }

uint32_t resonid_kind(const resonid_handle* handle) noexcept {
  const bool found = resonid::c::check_handle(handle) == RESONID_OK;
  return found ? reinterpret_cast<const Header*>(handle)->kind : 0;
}
size_t resonid_handle_size(const resonid_handle* handle) noexcept {
  const bool found = resonid::c::check_handle(handle) == RESONID_OK;
  return found ? reinterpret_cast<const Header*>(handle)->size : 0;
}

resonid_status resonid_step(resonid_handle* handle, double ru, double u, double y) noexcept {
  return with(handle, [&](const Operations& o) -> resonid_status {
    if (o.step == nullptr) return RESONID_ERROR_UNSUPPORTED;
    o.step(handle, ru, u, y);
    return RESONID_OK;
  });
}
resonid_status resonid_run(resonid_handle* handle, const double* ru, const double* u, const double* y,
                           size_t count) noexcept {
  return resonid::c::run_signals(handle, ru, u, y, count, &Operations::run);
}
resonid_status resonid_run_float(resonid_handle* handle, const float* ru, const float* u, const float* y,
                                 size_t count) noexcept {
  return resonid::c::run_signals(handle, ru, u, y, count, &Operations::run_float);
}
resonid_status resonid_miss(resonid_handle* handle, uint64_t count) noexcept {
  return with(handle, [&](const Operations& o) -> resonid_status {
    if (o.miss == nullptr) return RESONID_ERROR_UNSUPPORTED;
    o.miss(handle, count);
    return RESONID_OK;
  });
}
resonid_status resonid_reset(resonid_handle* handle) noexcept {
  return with(handle, [&](const Operations& o) {
    o.reset(handle);
    return RESONID_OK;
  });
}

resonid_status resonid_read(const resonid_handle* handle, uint32_t kind, resonid_results* results,
                            size_t struct_size) noexcept {
  return with(handle, [&](const Operations& o) -> resonid_status {
    const Header& h = *reinterpret_cast<const Header*>(handle);
    if (resonid::c::family_of(h.kind) != resonid::c::family_of(kind)) return RESONID_ERROR_UNSUPPORTED;
    return resonid::c::family(kind)->read(o, h, results, struct_size);
  });
}

resonid_status resonid_parameters(const resonid_handle* handle, double* parameters, size_t count) noexcept {
  return with(handle, [&](const Operations& o) -> resonid_status {
    if (o.get_parameters == nullptr) return RESONID_ERROR_UNSUPPORTED;
    if (const resonid_status status = resonid::c::check_array(parameters, count, o.parameters)) return status;
    o.get_parameters(handle, parameters);
    return RESONID_OK;
  });
}
resonid_status resonid_covariance(const resonid_handle* handle, double* covariance, size_t count) noexcept {
  return with(handle, [&](const Operations& o) -> resonid_status {
    if (o.get_covariance == nullptr) return RESONID_ERROR_UNSUPPORTED;
    const std::size_t n = o.parameters;
    if (const resonid_status status = resonid::c::check_array(covariance, count, n * n)) return status;
    o.get_covariance(handle, covariance);
    return RESONID_OK;
  });
}
resonid_status resonid_lag_samples(const resonid_handle* handle, double* lag_samples) noexcept {
  if (lag_samples == nullptr) return RESONID_ERROR_NULL;
  return with(handle, [&](const Operations& o) -> resonid_status {
    if (o.lag_samples == nullptr) return RESONID_ERROR_UNSUPPORTED;
    *lag_samples = o.lag_samples(handle);
    return RESONID_OK;
  });
}
