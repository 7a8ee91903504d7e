// The version of the program, defined by the CMake project.

#pragma once

namespace slugs {

extern const char *const version;

} // namespace slugs
