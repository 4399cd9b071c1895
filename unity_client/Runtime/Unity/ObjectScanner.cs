using System.Collections.Generic;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>Which object to show next, and from which side: those the service is not sure of.</summary>
    internal sealed class ObjectScanner
    {
        const double SureFrom = 0.6; // confidence of a decision that needs no more looks

        readonly Dictionary<string, int> views = new Dictionary<string, int>();
        int openings = -1;
        int viewsEach;

        /// <summary>Whether no object is left to show, as of the last Next.</summary>
        public bool IsDone { get; private set; }

        /// <summary>Starts over when the link is new: a new session knows nothing.</summary>
        public void Follow(int nowOpenings, int nowViewsEach)
        {
            viewsEach = nowViewsEach;
            if (nowOpenings == openings) return;
            openings = nowOpenings;
            views.Clear();
            IsDone = false;
        }

        public bool Next(out HapticObject one, out int view)
        {
            for (int i = 0; i < HapticObject.All.Count; i++)
            {
                one = HapticObject.All[i];
                views.TryGetValue(one.ObjectId, out view);
                if (view >= viewsEach || IsSure(one, view)) continue;
                views[one.ObjectId] = view + 1;
                IsDone = false;
                return true;
            }
            one = null;
            view = 0;
            IsDone = true;
            return false;
        }

        /// <summary>The first view is always shown: its answer says what the name alone was good for.</summary>
        static bool IsSure(HapticObject one, int view)
        {
            if (one.StatedMaterial != null) return true;
            return view > 0 && one.Material != null && one.Source != Rung.Unknown && one.Confidence >= SureFrom;
        }
    }
}
