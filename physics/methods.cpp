namespace hydrostat::physics { extern const char* const kMethods; const char* const kMethods = "explicit euler"; }
