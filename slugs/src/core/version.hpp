// The version of the program; its one source is the CMake project.

#pragma once

namespace slugs {

extern const char *const version;

} // namespace slugs
