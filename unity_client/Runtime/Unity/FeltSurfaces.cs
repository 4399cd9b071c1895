using System.Collections.Generic;
using HapticVLM.Baked;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// What a touched surface is without the service: as a script stated it, else as the service decided it before, else
    /// as it was baked, else as the scene states it.
    /// </summary>
    internal sealed class FeltSurfaces
    {
        sealed class Thing
        {
            public readonly Dictionary<long, string> Decided = new Dictionary<long, string>(); // materials by surface
            public readonly Dictionary<long, FeltSurface> Known = new Dictionary<long, FeltSurface>(); // so that a renewal allocates nothing
            public string Miss; // why it is not felt, so that an inspector that asks in each picture searches no bake

            public void Forget()
            {
                Known.Clear();
                Miss = null;
            }
        }

        static readonly FeltSurface Nothing = new FeltSurface();

        readonly Dictionary<string, Thing> things = new Dictionary<string, Thing>();
        readonly Dictionary<string, string> effects = new Dictionary<string, string>(); // materials that scripts play, by id

        BakedScene baked;

        /// <summary>The surfaces of a bake; null for none.</summary>
        public BakedScene Baked
        {
            get { return baked; }
            set
            {
                baked = value;
                foreach (Thing thing in things.Values) thing.Forget();
            }
        }

        /// <summary>Notes what the service renders on a surface.</summary>
        public void Decide(Decision decision)
        {
            if (decision.ObjectId == null) return;
            Thing thing = Of(decision.ObjectId);
            string material = decision.Felt ?? (decision.Material == "unknown" ? null : decision.Material), before;
            if (thing.Decided.TryGetValue(decision.Surface ?? 0, out before) && before == material) return;
            thing.Decided[decision.Surface ?? 0] = material;
            thing.Known.Remove(decision.Surface ?? 0);
        }

        /// <summary>Notes the material of an effect without an object.</summary>
        public void Play(string id, string material)
        {
            effects[id] = material;
        }

        /// <summary>Notes that an object states something else from now on.</summary>
        public void Change(string objectId)
        {
            Thing thing;
            if (things.TryGetValue(objectId, out thing)) thing.Forget();
        }

        /// <summary>Forgets an object.</summary>
        public void Remove(string objectId)
        {
            things.Remove(objectId);
        }

        /// <summary>Returns the surface that a touch is on; without a material it is not felt.</summary>
        public FeltSurface Of(ref Touch touch)
        {
            if (touch.ObjectId == null) return Nothing;
            Thing thing = Of(touch.ObjectId);
            FeltSurface surface;
            if (thing.Known.TryGetValue(touch.Surface ?? 0, out surface)) return surface;
            surface = Find(thing, touch.ObjectId, touch.Surface ?? 0);
            thing.Known[touch.Surface ?? 0] = surface;
            return surface;
        }

        /// <summary>Returns why an object without a material is not felt, with the remedy.</summary>
        public string MissOf(HapticObject target)
        {
            Thing thing = Of(target.ObjectId);
            return thing.Miss ?? (thing.Miss = Miss(target));
        }

        string Miss(HapticObject target)
        {
            if (baked != null && BakedFeel.Find(baked, target, 0) != null) return "the bake does not know the material of '" + target.name + "': set it, or correct materials.json";
            string near = baked == null ? "there is no materials.json" : "nearest is '" + baked.Nearest(target.name) + "'";
            return "'" + target.name + "' is not in the bake; " + near + ": choose GameObject > HapticVLM > Bake Scene, or set its material";
        }

        FeltSurface Find(Thing thing, string objectId, long surface)
        {
            HapticObject target = HapticObject.ById(objectId);
            FeltSurface whole = baked == null || target == null ? null : BakedFeel.Find(baked, target, (int)surface);
            string material;
            if (target != null && target.IsStatedByScript) material = target.StatedMaterial;
            else if (!thing.Decided.TryGetValue(surface, out material))
            {
                if (whole != null) return whole;
                if (!effects.TryGetValue(objectId, out material) && target != null) material = target.StatedMaterial;
            }
            if (whole == null) return new FeltSurface { Material = material };
            return new FeltSurface { Material = material, ImpactGain = whole.ImpactGain, ThicknessM = whole.ThicknessM, Hum = whole.Hum };
        }

        Thing Of(string objectId)
        {
            Thing thing;
            if (!things.TryGetValue(objectId, out thing)) things[objectId] = thing = new Thing();
            return thing;
        }
    }
}
