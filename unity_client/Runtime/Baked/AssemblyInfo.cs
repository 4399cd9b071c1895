using System.Runtime.CompilerServices;

[assembly: InternalsVisibleTo("HapticVLM.Editor")]
[assembly: InternalsVisibleTo("HapticVLM.Unity")]
