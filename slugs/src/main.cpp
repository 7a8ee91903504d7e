// The command `slugs`.

#include <iostream>

int main() {
  std::cerr << "slugs: not yet connected to the solver\n";
  return 4;
}
