using System.Collections.Generic;

namespace HapticVLM
{
    /// <summary>
    /// Orders the surfaces of one object, the largest first, as a scene states them. All parts of an object that
    /// are drawn with the same material are one surface.
    /// </summary>
    public sealed class SurfaceOrder
    {
        readonly List<object> materials = new List<object>();
        readonly List<double> sizes = new List<double>();

        /// <summary>Number of surfaces.</summary>
        public int Count { get { return materials.Count; } }

        /// <summary>Returns the slot of the surface with this material, in the order of the first calls.</summary>
        public int SlotOf(object material)
        {
            for (int slot = 0; slot < materials.Count; slot++)
            {
                if (ReferenceEquals(materials[slot], material)) return slot;
            }
            materials.Add(material);
            sizes.Add(0.0);
            return materials.Count - 1;
        }

        public object MaterialOf(int slot)
        {
            return materials[slot];
        }

        /// <summary>Adds the size of a part to the surface in a slot; all sizes have the same unit.</summary>
        public void Grow(int slot, double size)
        {
            sizes[slot] += size;
        }

        /// <summary>Returns the slots of the largest surfaces, at most this many; equal ones keep their order.</summary>
        public List<int> LargestFirst(int most)
        {
            var slots = new List<int>();
            for (int i = 0; i < Count; i++) slots.Add(i);
            slots.Sort((a, b) => sizes[a] != sizes[b] ? sizes[b].CompareTo(sizes[a]) : a.CompareTo(b));
            if (slots.Count > most) slots.RemoveRange(most, slots.Count - most);
            return slots;
        }
    }
}
