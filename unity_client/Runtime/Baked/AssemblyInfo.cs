using System.Runtime.CompilerServices;

[assembly: InternalsVisibleTo("HapticVLM.Editor")]
