// Engine members that only the samples use.
using System;

namespace UnityEngine
{
    public enum PrimitiveType { Cube = 3 }

}
