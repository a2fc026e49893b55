// SPDX-License-Identifier: MIT
#include <resonid/c/resonid.h>

#include "handle.hpp"

#define RESONID_TEXT_OF(x) #x
#define RESONID_TEXT(x) RESONID_TEXT_OF(x)
#define RESONID_VERSION_TEXT          \
  RESONID_TEXT(RESONID_VERSION_MAJOR) \
  "." RESONID_TEXT(RESONID_VERSION_MINOR) "." RESONID_TEXT(RESONID_VERSION_PATCH)

namespace resonid::c {

static_assert(std::string_view(RESONID_VERSION_TEXT) == RESONID_PROJECT_VERSION,
              "the version in resonid/c/types.h is that of the project");

resonid_status check_header(const void* memory, std::uint32_t family) noexcept {
  Header h;
  std::memcpy(&h, memory, sizeof h);
  if (h.magic != kMagic || h.version != kVersion || h.family != family || h.size < sizeof h)
    return RESONID_ERROR_HANDLE;
  return RESONID_OK;
}

}  // namespace resonid::c

using resonid::c::Header;

const char* resonid_version(void) noexcept { return RESONID_VERSION_TEXT; }

uint32_t resonid_version_number(void) noexcept { return resonid::c::kVersion; }

const char* resonid_status_string(resonid_status status) noexcept {
  switch (status) {
    case RESONID_OK:
      return "done";
    case RESONID_ERROR_NULL:
      return "an argument that must not be NULL is";
    case RESONID_ERROR_HANDLE:
      return "not a handle of this family and library version";
    case RESONID_ERROR_SIZE:
      return "memory too small, or a struct size that is none";
    case RESONID_ERROR_ALIGNMENT:
      return "memory is not aligned";
    case RESONID_ERROR_CONFIG:
      return "a field of the configuration is refused";
    case RESONID_ERROR_RANGE:
      return "no such line, channel or count";
    case RESONID_ERROR_MEMORY:
      return "no memory";
    case RESONID_ERROR_UNSUPPORTED:
      return "this kind has no such figure";
    default:
      return "unknown status";
  }
}

size_t resonid_handle_size(const void* handle) noexcept {
  if (handle == nullptr || reinterpret_cast<std::uintptr_t>(handle) % RESONID_ALIGNMENT != 0) return 0;
  const Header& h = *static_cast<const Header*>(handle);
  return h.magic == resonid::c::kMagic && h.version == resonid::c::kVersion ? h.size : 0;
}

resonid_status resonid_check(const void* memory, size_t size, uint32_t family,
                             resonid_error* error) noexcept {
  using resonid::c::fail;
  if (memory == nullptr) return resonid::c::fail_null(error, "memory");
  if (size < sizeof(Header)) return fail(error, RESONID_ERROR_SIZE, {"size", "is less than a header has"});
  if (const resonid_status status = resonid::c::check_header(memory, family))
    return fail(error, status, {"memory", "must hold a handle of this family and library version"});
  Header h;
  std::memcpy(&h, memory, sizeof h);
  if (size < h.size)
    return fail(error, RESONID_ERROR_SIZE,
                {"size", "is less than the handle has", static_cast<double>(size)});
  return RESONID_OK;
}

resonid_status resonid_restore(void* memory, size_t memory_size, const void* snapshot, size_t snapshot_size,
                               uint32_t family, resonid_error* error) noexcept {
  using resonid::c::fail;
  if (memory == nullptr) return resonid::c::fail_null(error, "memory");
  if (snapshot == nullptr) return resonid::c::fail_null(error, "snapshot");
  if (reinterpret_cast<std::uintptr_t>(memory) % RESONID_ALIGNMENT != 0)
    return fail(error, RESONID_ERROR_ALIGNMENT, {"memory", "must be aligned to RESONID_ALIGNMENT"});
  if (const resonid_status status = resonid_check(snapshot, snapshot_size, family, error)) return status;
  Header h;
  std::memcpy(&h, snapshot, sizeof h);
  if (memory_size < h.size)
    return fail(error, RESONID_ERROR_SIZE,
                {"memory_size", "is less than the snapshot has", static_cast<double>(memory_size)});
  std::memmove(memory, snapshot, h.size);
  return RESONID_OK;
}

void resonid_destroy(void* handle) noexcept { std::free(handle); }
