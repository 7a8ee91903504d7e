// The variables of a specification.

#pragma once

#include "core/budget.hpp"
#include "read/sections.hpp"

namespace slugs {

// slugsin: one name per line, indices in the order of the file.
void declare_slugsin(const Sections &sections, const Source &source, Specification &specification,
                     Diagnostics &diagnostics, BudgetPacer &pacer);

// structuredslugs: one name, or one integer as name:min...max, per line; all
// inputs come before all outputs.  Integers become bits; if these can hold
// values beyond the range, a limit is added to the owner's INIT and TRANS.
void declare_structured(const Sections &sections, const Source &source, Specification &specification,
                        Diagnostics &diagnostics, BudgetPacer &pacer);
void limit_ranges(Specification &specification, BudgetPacer &pacer);

} // namespace slugs
